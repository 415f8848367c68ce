"""Net, contact, sight and fold plan: geometry and decisions, no physics and no machine."""
