// The executable whose precompiled header every test reuses.
int main() { return 0; }
