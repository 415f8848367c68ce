"""Physics: heating, MuJoCo model, validation and process table."""
