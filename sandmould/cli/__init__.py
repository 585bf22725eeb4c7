"""The command ``sandmould``: thin, each verb calls the rooms below."""
