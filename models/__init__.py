"""Data that ships with the product: goal shapes and MJCF. No logic but finding the files."""
