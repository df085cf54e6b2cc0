"""The referee: replays a plan, says what it earns and which rules it breaks."""
