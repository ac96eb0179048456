// A program as a node of ROS 2 appears in DDS: it uses ros2_messages.idl, the names of topics and
// types of ROS 2 and its default QoS, and nothing of this project.
//
//   ros2_client [-d DOMAIN] watch SECONDS       prints what /wm/pose, /sp/points and /tf have
//   ros2_client [-d DOMAIN] [-f FRAME] sensors SECONDS   /points 10 Hz, /imu 100 Hz, /fix 5 Hz,
//                                               /odom 20 Hz from a vehicle at rest
//   ros2_client [-d DOMAIN] hostile             /points with one fault each, then as fast as it can
// At its end it prints the number of readers of each topic that it has published.
// Exit status: 0 done; 2 wrong usage; 3 DDS could not create an entity.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dds/dds.h"
#include "ros2_messages.h"

typedef sensor_msgs_msg_dds__PointCloud2_ cloud_t;
typedef std_msgs_msg_dds__Header_ header_t;

static dds_entity_t participant;
static const char* frame = "os_lidar";

static dds_entity_t made(dds_entity_t e, const char* what) {
  if (e < 0) {
    printf("no %s: %s\n", what, dds_strretcode(-e));
    exit(3);
  }
  return e;
}

static dds_entity_t topic(const dds_topic_descriptor_t* type, const char* name) {
  return made(dds_create_topic(participant, type, name, NULL, NULL), name);
}

static dds_qos_t* qos(dds_reliability_kind_t kind, int depth) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_reliability(q, kind, DDS_MSECS(100));
  dds_qset_durability(q, DDS_DURABILITY_VOLATILE);
  dds_qset_history(q, DDS_HISTORY_KEEP_LAST, depth);
  return q;
}

static dds_entity_t subscribe(const dds_topic_descriptor_t* type, const char* name) {
  dds_qos_t* q = qos(DDS_RELIABILITY_RELIABLE, 10);  // the default of a subscription
  const dds_entity_t r = made(dds_create_reader(participant, topic(type, name), q, NULL), name);
  dds_delete_qos(q);
  return r;
}

static dds_entity_t advertise(const dds_topic_descriptor_t* type, const char* name) {
  dds_qos_t* q = qos(DDS_RELIABILITY_BEST_EFFORT, 5);  // "sensor data"
  const dds_entity_t w = made(dds_create_writer(participant, topic(type, name), q, NULL), name);
  dds_delete_qos(q);
  return w;
}

// ---- watch ---------------------------------------------------------------------------------

static float float_at(const uint8_t* data) {
  float value;
  memcpy(&value, data, sizeof value);
  return value;
}

static void print_pose(const void* sample) {
  const geometry_msgs_msg_dds__PoseWithCovarianceStamped_* m = sample;
  printf("pose %s stamp %d at %.3f %.3f %.3f variance x %.4f y %.4f\n", m->header.frame_id,
         m->header.stamp.sec, m->pose.pose.position.x, m->pose.pose.position.y,
         m->pose.pose.position.z, m->pose.covariance[0], m->pose.covariance[7]);
}

static void print_cloud(const void* sample) {
  const cloud_t* m = sample;
  printf("cloud %s stamp %d points %u fields %u", m->header.frame_id, m->header.stamp.sec,
         m->width * m->height, m->fields._length);
  if (m->data._length >= 12) {
    printf(" first %.2f %.2f %.2f", (double)float_at(m->data._buffer),
           (double)float_at(m->data._buffer + 4), (double)float_at(m->data._buffer + 8));
  }
  printf("\n");
}

static void print_tf(const void* sample) {
  const tf2_msgs_msg_dds__TFMessage_* m = sample;
  for (uint32_t i = 0; i < m->transforms._length; ++i) {
    const geometry_msgs_msg_dds__TransformStamped_* t = &m->transforms._buffer[i];
    printf("tf %s>%s at %.3f %.3f %.3f\n", t->header.frame_id, t->child_frame_id,
           t->transform.translation.x, t->transform.translation.y, t->transform.translation.z);
  }
}

static int take(dds_entity_t reader, void (*print)(const void*)) {
  void* samples[16] = {NULL};
  dds_sample_info_t infos[16];
  int valid = 0;
  const int n = dds_take(reader, samples, infos, 16, 16);
  for (int i = 0; i < n; ++i) {
    if (!infos[i].valid_data) continue;
    print(samples[i]);
    ++valid;
  }
  if (n > 0) (void)dds_return_loan(reader, samples, n);
  return valid;
}

static void watch(double seconds) {
  const dds_entity_t pose =
      subscribe(&geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, "rt/wm/pose");
  const dds_entity_t cloud = subscribe(&sensor_msgs_msg_dds__PointCloud2__desc, "rt/sp/points");
  const dds_entity_t tf = subscribe(&tf2_msgs_msg_dds__TFMessage__desc, "rt/tf");
  printf("watching\n");
  fflush(stdout);
  int poses = 0;
  int clouds = 0;
  int transforms = 0;
  const dds_time_t end = dds_time() + (dds_time_t)(seconds * 1e9);
  while (dds_time() < end) {
    poses += take(pose, print_pose);
    clouds += take(cloud, print_cloud);
    transforms += take(tf, print_tf);
    fflush(stdout);
    usleep(10000);
  }
  printf("received poses %d clouds %d tf %d\n", poses, clouds, transforms);
}

// ---- publishers ----------------------------------------------------------------------------

static header_t header_now(const char* frame_id, double ahead_s) {
  const dds_time_t now = dds_time() + (dds_time_t)(ahead_s * 1e9);
  header_t h = {{(int32_t)(now / DDS_NSECS_IN_SEC), (uint32_t)(now % DDS_NSECS_IN_SEC)},
                (char*)frame_id};
  return h;
}

#define POINTS 8000
#define STEP 24

struct buffer {
  sensor_msgs_msg_dds__PointField_ fields[4];
  uint8_t data[POINTS * STEP];
};

static double uniform(uint32_t* state) {  // [-1, 1)
  *state = *state * 1664525U + 1013904223U;
  return *state / 2147483648.0 - 1.0;
}

// Rolling ground and two walls around the LADAR, in random directions, during the 0.1 s before the
// stamp of the last point.
static cloud_t make_cloud(struct buffer* b, uint32_t* random) {
  static const char* const kNames[] = {"x", "y", "z", "t"};
  for (uint32_t i = 0; i < 4; ++i) {
    sensor_msgs_msg_dds__PointField_ f = {(char*)kNames[i], i < 3 ? 4 * i : 20, i < 3 ? 7 : 6, 1};
    b->fields[i] = f;
  }
  for (uint32_t i = 0; i < POINTS; ++i) {
    float p[3];
    p[0] = (float)(25.0 * uniform(random));
    p[1] = (float)(25.0 * uniform(random));
    p[2] = (float)(0.6 * sin(0.25 * p[0]) * cos(0.2 * p[1] + 0.5) - 1.8);
    if (i % 4 == 0) p[0] = 18.0F;
    if (i % 4 == 1) p[1] = -15.0F;
    if (i % 4 < 2) p[2] = (float)(1.5 * uniform(random));
    const uint32_t t_ns = i * (100000000U / POINTS);
    memcpy(b->data + i * STEP, p, sizeof p);
    memcpy(b->data + i * STEP + 20, &t_ns, sizeof t_ns);
  }
  cloud_t m;
  memset(&m, 0, sizeof m);
  m.header = header_now(frame, -0.1);
  m.height = 1;
  m.width = POINTS;
  m.fields._buffer = b->fields;
  m.fields._length = m.fields._maximum = 4;
  m.point_step = STEP;
  m.row_step = STEP * POINTS;
  m.data._buffer = b->data;
  m.data._length = m.data._maximum = STEP * POINTS;
  m.is_dense = true;
  return m;
}

static void print_readers(dds_entity_t writer, const char* name) {
  dds_publication_matched_status_t status;
  if (dds_get_publication_matched_status(writer, &status) != DDS_RETCODE_OK) return;
  printf("readers of %s %u\n", name, status.current_count);
}

static void sensors(double seconds) {
  static struct buffer buffer;
  uint32_t random = 1;
  const dds_entity_t points = advertise(&sensor_msgs_msg_dds__PointCloud2__desc, "rt/points");
  const dds_entity_t imus = advertise(&sensor_msgs_msg_dds__Imu__desc, "rt/imu");
  const dds_entity_t fixes = advertise(&sensor_msgs_msg_dds__NavSatFix__desc, "rt/fix");
  const dds_entity_t odometry = advertise(&nav_msgs_msg_dds__Odometry__desc, "rt/odom");
  const dds_time_t begin = dds_time();
  for (int i = 0; dds_time() - begin < (dds_time_t)(seconds * 1e9); ++i) {
    sensor_msgs_msg_dds__Imu_ imu;
    memset(&imu, 0, sizeof imu);
    imu.header = header_now("imu_link", 0.0);
    imu.orientation_covariance[0] = -1.0;
    imu.angular_velocity.z = 0.01 * uniform(&random);
    imu.linear_acceleration.x = 0.01 * uniform(&random);
    imu.linear_acceleration.z = 9.81 + 0.01 * uniform(&random);
    (void)dds_write(imus, &imu);
    if (i % 5 == 0) {
      nav_msgs_msg_dds__Odometry_ m;
      memset(&m, 0, sizeof m);
      m.header = header_now("odom", 0.0);
      m.child_frame_id = (char*)"base_link";
      m.twist.twist.linear.x = 1.5;
      m.twist.covariance[0] = 0.04;
      (void)dds_write(odometry, &m);
    }
    if (i % 20 == 0) {
      sensor_msgs_msg_dds__NavSatFix_ m;
      memset(&m, 0, sizeof m);
      m.header = header_now("gps", 0.0);
      m.latitude = 39.125;
      m.longitude = -77.25;
      m.altitude = 120.0;
      (void)dds_write(fixes, &m);
    }
    if (i % 10 == 0) {
      const cloud_t m = make_cloud(&buffer, &random);
      (void)dds_write(points, &m);
    }
    usleep(10000);
  }
  print_readers(points, "/points");
  print_readers(imus, "/imu");
}

static void hostile(void) {
  static struct buffer buffer;
  uint32_t random = 1;
  const dds_entity_t points = advertise(&sensor_msgs_msg_dds__PointCloud2__desc, "rt/points");
  usleep(1000000);  // discovery
  for (int fault = 0; fault < 8; ++fault) {
    cloud_t m = make_cloud(&buffer, &random);
    const float nan_m = NAN;
    switch (fault) {
      case 0:
        m.header.frame_id = (char*)"camera";
        break;
      case 1:
        m.point_step = 0xFFFFFFFFU;
        break;
      case 2:
        m.width = 0xFFFFFFFFU;
        m.height = 0xFFFFFFFFU;
        break;
      case 3:
        m.data._length = 100;
        break;
      case 4:
        m.header = header_now(frame, 60.0);
        break;
      case 5:
        m.header = header_now(frame, -60.0);
        break;
      case 6:
        m.fields._length = 2;
        break;
      default:
        for (uint32_t i = 0; i < POINTS; ++i) memcpy(buffer.data + i * STEP, &nan_m, 4);
    }
    (void)dds_write(points, &m);
    printf("fault %d\n", fault);
    fflush(stdout);
    usleep(300000);
  }
  for (int i = 0; i < 1000; ++i) {
    const cloud_t m = make_cloud(&buffer, &random);
    (void)dds_write(points, &m);
  }
  printf("flood done\n");
  fflush(stdout);
  usleep(1000000);
  print_readers(points, "/points");
}

int main(int argc, char** argv) {
  dds_domainid_t domain = 0;
  int option;
  while ((option = getopt(argc, argv, "d:f:")) != -1) {
    if (option == 'd') domain = (dds_domainid_t)atoi(optarg);
    if (option == 'f') frame = optarg;
    if (option == '?') return 2;
  }
  if (optind >= argc) return 2;
  const char* const what = argv[optind];
  const double seconds = optind + 1 < argc ? atof(argv[optind + 1]) : 1.0;
  participant = made(dds_create_participant(domain, NULL, NULL), "participant");
  if (strcmp(what, "watch") == 0) {
    watch(seconds);
  } else if (strcmp(what, "sensors") == 0) {
    sensors(seconds);
  } else if (strcmp(what, "hostile") == 0) {
    hostile();
  } else {
    return 2;
  }
  fflush(stdout);
  (void)dds_delete(participant);
  return 0;
}
