"""Worlds in series: the axes files of VRX's world generator, each of which stands for many worlds."""
