"""Meshes to be charted, and judges of charts that know nothing of how they were made."""
