"""The blossom command, reports and progress: reads what the other packages make."""
