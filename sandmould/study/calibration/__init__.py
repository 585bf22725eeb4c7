"""From measured angles and times to contact parameters: emulators, iso-lines, posteriors."""
