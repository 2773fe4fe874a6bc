// A library of the name and with the functions of Cyclone DDS, as an SDK brings its own: here they
// answer who they are.
extern "C" {
int dds_create_participant(unsigned, const void*, const void*) { return 4242; }
int dds_delete(int) { return 4243; }
/// By a call of its own, which the linker may lead elsewhere.
int dds_get_participant(int) { return dds_create_participant(0, nullptr, nullptr); }
}
