// The source whose precompiled header every room reuses.
