"""What a study is, in TOML."""
