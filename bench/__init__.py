"""Speed and agreement, measured side by side with Cycles."""
