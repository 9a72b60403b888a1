"""How fast receiver and generator are on this machine, and how fast they could be: ``bicode bench`` and notebook 20."""
