"""What a study is, in TOML: its file, checked, and the presets."""
