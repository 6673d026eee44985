"""From rays to values whose error is known."""
