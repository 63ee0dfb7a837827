"""Readers of high-speed recordings, one file a format, all behind one protocol (``reader.Recording``)."""
