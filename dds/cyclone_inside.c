// The headers of Cyclone DDS's inside are not C++.
#include <string.h>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_domaingv.h>
#include <dds/ddsi/ddsi_entity.h>
#include <dds/ddsi/ddsi_entity_index.h>
#include <dds/ddsi/ddsi_guid.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_bswap.h>
#include <dds/ddsi/q_hbcontrol.h>
#include <dds/ddsi/q_thread.h>

// Need the above.
#include <dds/ddsi/ddsi_endpoint.h>
#include <dds/ddsi/ddsi_entity_match.h>
#include <dds/ddsi/ddsi_proxy_endpoint.h>

void tandem_dds_send_hashes(dds_entity_t writer);
void tandem_dds_hear_from_first(dds_entity_t reader);

// That of an entity; NULL: it is none, or memory is short. A sample of any topic leads to it.
static struct ddsi_domaingv* domain_of(dds_entity_t entity) {
  struct ddsi_domaingv* found = NULL;
  struct ddsi_serdata* sample = NULL;
  dds_sample_info_t info;
  const dds_entity_t participants =
      dds_create_reader(dds_get_participant(entity), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, NULL, NULL);
  if (participants < 0) return NULL;
  if (dds_readcdr(participants, &sample, 1, &info, DDS_ANY_STATE) == 1) {
    found = ddsrt_atomic_ldvoidp(&((struct ddsi_sertype*)sample->type)->gv);
    ddsi_serdata_unref(sample);
  }
  dds_delete(participants);
  return found;
}

static int guid_of(dds_entity_t entity, ddsi_guid_t* guid) {
  dds_guid_t bytes;
  if (dds_get_guid(entity, &bytes) != DDS_RETCODE_OK) return 0;
  memcpy(guid, &bytes, sizeof *guid);
  *guid = nn_ntoh_guid(*guid);
  return 1;
}

void tandem_dds_send_hashes(dds_entity_t writer) {
  ddsi_guid_t guid;
  struct ddsi_domaingv* const domain = domain_of(writer);
  if (domain == NULL || !guid_of(writer, &guid)) return;
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

// Writers that the reader has found already: their next heartbeat is none that begins anew.
static void hear_known_writers(dds_entity_t reader, const struct ddsi_domaingv* domain) {
  dds_instance_handle_t known[64];
  const dds_return_t count = dds_get_matched_publications(reader, known, 64);
  for (dds_return_t i = 0; i < count && i < 64; ++i) {
    dds_builtintopic_endpoint_t* const peer = dds_get_matched_publication_data(reader, known[i]);
    if (peer == NULL) continue;
    ddsi_guid_t guid;
    memcpy(&guid, &peer->key, sizeof guid);
    guid = nn_ntoh_guid(guid);
    dds_builtintopic_free_endpoint(peer);
    struct thread_state* const thread = lookup_thread_state();
    thread_state_awake(thread, domain);
    struct ddsi_proxy_writer* const writer =
        entidx_lookup_proxy_writer_guid(domain->entity_index, &guid);
    if (writer != NULL && !vendor_is_eclipse(writer->c.vendor)) {
      ddsrt_mutex_lock(&writer->e.lock);
      writer->have_seen_heartbeat = 1;
      ddsrt_mutex_unlock(&writer->e.lock);
    }
    thread_state_asleep(thread);
  }
}

void tandem_dds_hear_from_first(dds_entity_t reader) {
  ddsi_guid_t guid;
  struct ddsi_domaingv* const domain = domain_of(reader);
  if (domain == NULL || !guid_of(reader, &guid)) return;
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  struct ddsi_reader* const found = entidx_lookup_reader_guid(domain->entity_index, &guid);
  if (found != NULL) {
    ddsrt_mutex_lock(&found->e.lock);
    found->handle_as_transient_local = 1;
    ddsrt_mutex_unlock(&found->e.lock);
  }
  thread_state_asleep(thread);
  hear_known_writers(reader, domain);
}
