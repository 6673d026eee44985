"""What the project promises of speed and memory, measured: docs/figures.md."""
