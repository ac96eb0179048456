// An off-board program: it uses vehicle.idl and nothing else of this project. DDS reads the
// configuration of networks and keys from $CYCLONEDDS_URI (see config/dds).
//
//   dds_client [OPTION...] watch SECONDS         prints VehicleState and NodeStatus
//   dds_client [OPTION...] goto ID SECONDS X Y [X Y...]   repeats the command for so long
//   dds_client [OPTION...] follow ID SECONDS X Y [X Y...]
//   dds_client [OPTION...] return|halt|stop|release ID SECONDS
//   dds_client [OPTION...] stops COUNT           stop, 1 s later release, and so on; prints the
//   time
//                                               of each stop by CLOCK_MONOTONIC [us]
//   dds_client [OPTION...] flood SECONDS         commands of 300 operators and releases of ever new
//                                               ones, no pause
// -d DOMAIN  -v VEHICLE  -o OPERATOR  -p PARTITION (default: the operator)
// -s SPEED [m/s]  -f VALID_FOR [ms]  -n COUNT (of waypoints: the last one again and again)
// Exit status: 0 done; 1 no vehicle has received it, or none does any more; 2 wrong usage; 3 DDS
// could not create an entity.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "dds/dds.h"
#include "vehicle.h"

#define MAX_WAYPOINTS 256

struct options {
  dds_domainid_t domain;
  const char* vehicle;
  const char* operator_id;
  const char* partition;
  double speed_mps;
  int valid_for_ms;
  int count;
};

static dds_entity_t made(dds_entity_t e, const char* what) {
  if (e < 0) {
    printf("refused: no %s: %s\n", what, dds_strretcode(-e));
    fflush(stdout);
    _Exit(3);  // exit() would clean up OpenSSL while threads of DDS still use it
  }
  return e;
}

static dds_qos_t* reliable(const char* partition, bool transient_local) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_reliability(q, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_history(q, DDS_HISTORY_KEEP_LAST, 1);
  if (transient_local) dds_qset_durability(q, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_partition1(q, partition);
  return q;
}

static dds_entity_t reader(dds_entity_t participant, const dds_topic_descriptor_t* type,
                           const char* name, dds_qos_t* qos) {
  const dds_entity_t topic = made(dds_create_topic(participant, type, name, NULL, NULL), "topic");
  const dds_entity_t r = made(dds_create_reader(participant, topic, qos, NULL), "reader");
  dds_delete_qos(qos);
  return r;
}

static dds_entity_t writer(dds_entity_t participant, const dds_topic_descriptor_t* type,
                           const char* name, dds_qos_t* qos) {
  const dds_entity_t topic = made(dds_create_topic(participant, type, name, NULL, NULL), "topic");
  const dds_entity_t w = made(dds_create_writer(participant, topic, qos, NULL), "writer");
  dds_delete_qos(qos);
  return w;
}

// ---- watch ---------------------------------------------------------------------------------

struct seen {
  int states;
  dds_time_t first, last;
};

static void take_states(dds_entity_t r, struct seen* seen) {
  void* samples[16] = {NULL};
  dds_sample_info_t infos[16];
  const int n = dds_take(r, samples, infos, 16, 16);
  for (int i = 0; i < n; ++i) {
    if (!infos[i].valid_data) continue;
    const rcs_VehicleState* s = samples[i];
    seen->last = dds_time();
    if (seen->states++ == 0) seen->first = seen->last;
    printf("state %s seq %llu mode %d p %.3f %.3f %.3f sigma_x %.3f age %lld us datum %.6f %.6f\n",
           s->vehicle, (unsigned long long)s->seq, (int)s->mode, s->p_world_vehicle_m[0],
           s->p_world_vehicle_m[1], s->p_world_vehicle_m[2], s->cov_world_pose[0],
           (long long)s->age_us, s->datum_lat_deg, s->datum_lon_deg);
  }
  if (samples[0] != NULL) dds_return_loan(r, samples, n);
}

static void take_statuses(dds_entity_t r) {
  void* samples[16] = {NULL};
  dds_sample_info_t infos[16];
  const int n = dds_take(r, samples, infos, 16, 16);
  for (int i = 0; i < n; ++i) {
    if (!infos[i].valid_data) continue;
    const rcs_NodeStatus* s = samples[i];
    printf("node %s %s alive %d overruns %lld state \"%s\" reason \"%s\"\n", s->vehicle, s->node,
           s->alive, (long long)s->overruns, s->state, s->reason);
  }
  if (samples[0] != NULL) dds_return_loan(r, samples, n);
}

static int watch(dds_entity_t participant, double seconds) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_partition1(q, "*");
  dds_qset_history(q, DDS_HISTORY_KEEP_LAST, 16);
  const dds_entity_t states = reader(participant, &rcs_VehicleState_desc, "VehicleState", q);
  const dds_entity_t statuses =
      reader(participant, &rcs_NodeStatus_desc, "NodeStatus", reliable("*", true));
  const dds_entity_t waitset = made(dds_create_waitset(participant), "waitset");
  dds_set_status_mask(states, DDS_DATA_AVAILABLE_STATUS);
  dds_set_status_mask(statuses, DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(waitset, states, 0);
  dds_waitset_attach(waitset, statuses, 0);
  struct seen seen = {0, 0, 0};
  const dds_time_t end = dds_time() + (dds_duration_t)(seconds * 1e9);
  while (dds_waitset_wait_until(waitset, NULL, 0, end) > 0) {
    take_states(states, &seen);
    take_statuses(statuses);
    fflush(stdout);
  }
  const double span = (double)(seen.last - seen.first) * 1e-9;
  printf("states %d rate %.2f Hz\n", seen.states, span > 0 ? (seen.states - 1) / span : 0.0);
  return 0;
}

/// @return their number
static int take_samples(dds_entity_t r) {
  void* samples[16] = {NULL};
  dds_sample_info_t infos[16];
  const int n = dds_take(r, samples, infos, 16, 16);
  if (samples[0] != NULL) dds_return_loan(r, samples, n);
  return n;
}

// ---- write ---------------------------------------------------------------------------------

// A write succeeds without any reader, also for an identity that the vehicle no longer accepts. If
// its permissions end while it is connected the reader stays matched, but the vehicle publishes
// nothing for it any more.
static int repeat(dds_entity_t participant, dds_entity_t w, const void* sample, double seconds) {
  const dds_entity_t statuses =
      reader(participant, &rcs_NodeStatus_desc, "NodeStatus", reliable("*", true));
  const dds_time_t begin = dds_time();
  const dds_time_t end = begin + (dds_duration_t)(seconds * 1e9);
  dds_time_t heard = begin;
  bool received = false;
  bool silent = false;
  do {
    const dds_return_t rc = dds_write(w, sample);
    dds_publication_matched_status_t matched;
    dds_get_publication_matched_status(w, &matched);
    received = received || matched.total_count > 0;
    printf("written: %s, readers %u\n", dds_strretcode(-rc), matched.current_count);
    if (take_samples(statuses) > 0) heard = dds_time();
    const bool was_silent = silent;
    silent = matched.current_count == 0 ? dds_time() - begin > DDS_SECS(2)
                                        : dds_time() - heard > DDS_SECS(3);
    if (silent && !was_silent) {
      printf(
          "no vehicle receives this: none is reachable, or this identity has expired, was revoked "
          "or is of another authority (`rcs keys` lists the ends)\n");
    }
    fflush(stdout);
    dds_sleepfor(DDS_MSECS(200));
  } while (dds_time() < end);
  return received && !silent ? 0 : 1;
}

static int command(dds_entity_t participant, const struct options* o, rcs_CommandKind kind,
                   char** args, int n_args) {
  rcs_WaypointCommand c;
  rcs_Waypoint waypoints[MAX_WAYPOINTS];
  memset(&c, 0, sizeof c);
  memset(waypoints, 0, sizeof waypoints);
  snprintf(c.vehicle, sizeof c.vehicle, "%s", o->vehicle);
  snprintf(c.operator_id, sizeof c.operator_id, "%s", o->operator_id);
  c.command_id = strtoll(args[0], NULL, 10);
  c.kind = kind;
  c.frame = rcs_FRAME_WORLD;
  c.valid_for_ms = o->valid_for_ms;
  int n = (n_args - 2) / 2;
  for (int i = 0; i < n || i < o->count; ++i) {
    const int k = i < n ? i : n - 1;
    waypoints[i].p_m[0] = strtod(args[2 + 2 * k], NULL);
    waypoints[i].p_m[1] = strtod(args[3 + 2 * k], NULL);
    waypoints[i].radius_m = 2.0;
    waypoints[i].speed_mps = o->speed_mps;
  }
  if (o->count > n) n = o->count;
  c.waypoints._buffer = waypoints;
  c.waypoints._length = c.waypoints._maximum = (uint32_t)n;
  const dds_entity_t w = writer(participant, &rcs_WaypointCommand_desc, "WaypointCommand",
                                reliable(o->partition, false));
  return repeat(participant, w, &c, strtod(args[1], NULL));
}

static int stop(dds_entity_t participant, const struct options* o, bool engage, char** args) {
  rcs_EmergencyStop s;
  memset(&s, 0, sizeof s);
  snprintf(s.vehicle, sizeof s.vehicle, "%s", o->vehicle);
  snprintf(s.operator_id, sizeof s.operator_id, "%s", o->operator_id);
  s.command_id = strtoll(args[0], NULL, 10);
  s.engage = engage;
  const dds_entity_t w =
      writer(participant, &rcs_EmergencyStop_desc, "EmergencyStop", reliable(o->partition, true));
  return repeat(participant, w, &s, strtod(args[1], NULL));
}

static int stops(dds_entity_t participant, const struct options* o, int count) {
  rcs_EmergencyStop s;
  memset(&s, 0, sizeof s);
  snprintf(s.vehicle, sizeof s.vehicle, "%s", o->vehicle);
  snprintf(s.operator_id, sizeof s.operator_id, "%s", o->operator_id);
  const dds_entity_t w =
      writer(participant, &rcs_EmergencyStop_desc, "EmergencyStop", reliable(o->partition, true));
  dds_publication_matched_status_t matched = {0, 0, 0, 0, 0};
  while (matched.current_count == 0) {
    dds_sleepfor(DDS_MSECS(50));
    dds_get_publication_matched_status(w, &matched);
  }
  const long long first_id = dds_time() / 1000;  // larger than any of an earlier process
  for (int k = 0; k < count; ++k) {
    struct timespec t;
    s.command_id = first_id + 2 * k;
    s.engage = true;
    clock_gettime(CLOCK_MONOTONIC, &t);
    (void)dds_write(w, &s);
    printf("stop at %lld\n", (long long)t.tv_sec * 1000000 + t.tv_nsec / 1000);
    fflush(stdout);
    // At any phase of the cycles of gateway and BG.
    dds_sleepfor(DDS_MSECS(1000) + DDS_USECS(rand() % 100000));
    s.command_id = first_id + 2 * k + 1;
    s.engage = false;
    (void)dds_write(w, &s);
    dds_sleepfor(DDS_MSECS(1000));
  }
  return 0;
}

static int flood(dds_entity_t participant, const struct options* o, double seconds) {
  rcs_WaypointCommand c;
  rcs_EmergencyStop s;
  memset(&c, 0, sizeof c);
  memset(&s, 0, sizeof s);
  snprintf(c.vehicle, sizeof c.vehicle, "%s", o->vehicle);
  snprintf(s.vehicle, sizeof s.vehicle, "%s", o->vehicle);
  const dds_entity_t commands = writer(participant, &rcs_WaypointCommand_desc, "WaypointCommand",
                                       reliable(o->partition, false));
  const dds_entity_t stops =
      writer(participant, &rcs_EmergencyStop_desc, "EmergencyStop", reliable(o->partition, true));
  const dds_time_t end = dds_time() + (dds_duration_t)(seconds * 1e9);
  long long n = 0;
  for (; dds_time() < end; ++n) {
    c.command_id = s.command_id = n;
    snprintf(c.operator_id, sizeof c.operator_id, "flood%d", (int)(n % 300));
    snprintf(s.operator_id, sizeof s.operator_id, "flood%lld", n);
    (void)dds_write(commands, &c);
    (void)dds_write(stops, &s);
    if (n % 1000 == 0) {
      printf("flooded %lld\n", n);
      fflush(stdout);
    }
  }
  printf("flooded %lld in all\n", n);
  return 0;
}

int main(int argc, char** argv) {
  struct options o = {0, "vehicle", "alice", NULL, 3.0, 2000, 0};
  int c;
  while ((c = getopt(argc, argv, "+d:v:o:p:s:f:n:")) != -1) {
    switch (c) {
      case 'd':
        o.domain = (dds_domainid_t)strtoul(optarg, NULL, 10);
        break;
      case 'v':
        o.vehicle = optarg;
        break;
      case 'o':
        o.operator_id = optarg;
        break;
      case 'p':
        o.partition = optarg;
        break;
      case 's':
        o.speed_mps = strtod(optarg, NULL);
        break;
      case 'f':
        o.valid_for_ms = atoi(optarg);
        break;
      case 'n':
        o.count = atoi(optarg);
        break;
      default:
        return 2;
    }
  }
  if (o.partition == NULL) o.partition = o.operator_id;
  char** args = argv + optind + 1;
  const int n = argc - optind - 1;
  if (n < 1 || o.count > MAX_WAYPOINTS || n > 2 * MAX_WAYPOINTS) return 2;
  const char* what = argv[optind];
  const dds_entity_t participant =
      made(dds_create_participant(o.domain, NULL, NULL), "participant");
  int status = 2;
  if (strcmp(what, "watch") == 0) status = watch(participant, strtod(args[0], NULL));
  if (strcmp(what, "goto") == 0 && n >= 4)
    status = command(participant, &o, rcs_COMMAND_GOTO, args, n);
  if (strcmp(what, "follow") == 0 && n >= 4)
    status = command(participant, &o, rcs_COMMAND_FOLLOW, args, n);
  if (strcmp(what, "return") == 0 && n >= 2)
    status = command(participant, &o, rcs_COMMAND_RETURN, args, n);
  if (strcmp(what, "halt") == 0 && n >= 2)
    status = command(participant, &o, rcs_COMMAND_HALT, args, n);
  if (strcmp(what, "stop") == 0 && n >= 2) status = stop(participant, &o, true, args);
  if (strcmp(what, "release") == 0 && n >= 2) status = stop(participant, &o, false, args);
  if (strcmp(what, "stops") == 0) status = stops(participant, &o, atoi(args[0]));
  if (strcmp(what, "flood") == 0) status = flood(participant, &o, strtod(args[0], NULL));
  dds_delete(participant);
  return status;
}
