"""NMEA 0183: what a boat's instruments and its AIS receiver write, for chart plotters."""

from vrx_mj.nmea.instruments import Instruments

__all__ = ["Instruments"]
