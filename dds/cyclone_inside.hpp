// What Cyclone DDS 0.10 does not offer, by its inside. Other versions: service_layout_cyclone.cpp.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <dds/dds.h>

extern "C" {

/// The inline QoS of what `writer` sends has a key's hash from now on.
void tandem_dds_send_hashes(dds_entity_t writer);

/// `reader` gets all that a peer has sent since it found the reader. By itself, Cyclone DDS leaves
/// out what came from another maker's reliable writer before that writer's first heartbeat: the
/// first request of a client, or the only message of `ros2 topic pub --once`.
/// To be called once, when the reader has been made.
void tandem_dds_hear_from_first(dds_entity_t reader);
}
