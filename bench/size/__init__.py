"""What a level of very many objects costs, over many machines: docs/size.md."""
