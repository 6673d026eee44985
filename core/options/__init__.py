"""The options of a bake, each in one row of one table: of it the command's arguments, the panel's properties, what
images and reports tell, and what a child process is handed are made."""
