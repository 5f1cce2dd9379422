"""What is proven of a law: bounds of its error, margins."""
