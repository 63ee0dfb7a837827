"""The cavity behind the sphere: its profile, its necks, when and how it closes."""
