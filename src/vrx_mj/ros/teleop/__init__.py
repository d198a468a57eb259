"""Driving a world that is served, as a client of its rosbridge: by keys in a terminal, or by a page in a browser."""
