"""Laws and parameters side by side."""
