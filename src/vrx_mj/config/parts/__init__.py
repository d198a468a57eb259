"""VRX's thruster and component files: what they may say, what it means, and whether it is legal."""
