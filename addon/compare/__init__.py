"""The comparison with Cycles."""
