"""What tests and benchmarks know to be right, and how they make what they try it on."""
