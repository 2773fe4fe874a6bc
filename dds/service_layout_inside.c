// The part of service_layout.cpp whose headers of Cyclone DDS are not C++.
#include <string.h>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_domaingv.h>
#include <dds/ddsi/ddsi_entity.h>
#include <dds/ddsi/ddsi_entity_index.h>
#include <dds/ddsi/ddsi_guid.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_bswap.h>
#include <dds/ddsi/q_hbcontrol.h>
#include <dds/ddsi/q_thread.h>

// Needs the above.
#include <dds/ddsi/ddsi_endpoint.h>

// The inline QoS of what `writer` sends has a key's hash from now on.
void tandem_dds_send_hashes(dds_entity_t writer, const struct ddsi_sertype* type) {
  dds_guid_t bytes;
  ddsi_guid_t guid;
  if (dds_get_guid(writer, &bytes) != DDS_RETCODE_OK) return;
  memcpy(&guid, &bytes, sizeof guid);
  guid = nn_ntoh_guid(guid);
  struct ddsi_domaingv* const domain = ddsrt_atomic_ldvoidp(&((struct ddsi_sertype*)type)->gv);
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  struct ddsi_writer* const found = entidx_lookup_writer_guid(domain->entity_index, &guid);
  if (found != NULL) {
    ddsrt_mutex_lock(&found->e.lock);
    if (found->num_readers_requesting_keyhash == 0) ++found->num_readers_requesting_keyhash;
    ddsrt_mutex_unlock(&found->e.lock);
  }
  thread_state_asleep(thread);
}
