"""VRX's thruster and component files: their keys, what these mean, and whether they are legal."""
