"""Tasks: state machines over a stream of frames, without MuJoCo, and without each other."""
