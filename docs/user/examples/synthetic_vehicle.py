#!/usr/bin/env python3
"""The vehicle of synthetic_vehicle.cpp without its LADAR: publishes INS, GPS_FIX and ODOMETRY, and prints
the poses that WM publishes. Python's standard library is all that it needs: these messages fit into one
datagram, which LCM sends as 8 bytes of header, the channel's name, a zero byte and the message.
    lcm-gen --python --ppath out/lcm_python lcmtypes/*.lcm
    PYTHONPATH=out/lcm_python python3 docs/user/examples/synthetic_vehicle.py [SECONDS]
"""
import math
import os
import random
import socket
import struct
import sys
import time

import rcs

GROUP, PORT = "239.255.76.67", 7667
RADIUS_M, SPEED_MPS, STAND_S, ACCEL_MPS2, GRAVITY_MPS2 = 12.0, 4.0, 3.0, 1.0, 9.81
MODES = ("ALIGN", "GPS_INS", "GPS_INS_LADAR", "INS_LADAR", "INS_DR", "GPS_LADAR", "LADAR", "LOST")
LEVER_M = (-0.5, 1.1)  # antenna: x and z in the vehicle, [gps] lever_m
TICK_US = 5000         # INS 200 Hz


class Bus:
    """LCM on UDP multicast, one datagram a message."""

    def __init__(self):
        self.out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)  # stays on this computer
        self.sent = 0
        self.inp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.inp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.inp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self.inp.bind((GROUP, PORT))
        self.inp.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                            struct.pack("4sl", socket.inet_aton(GROUP), socket.INADDR_ANY))
        self.inp.setblocking(False)

    def publish(self, channel, message):
        header = struct.pack(">II", 0x4C433032, self.sent & 0xFFFFFFFF)
        self.out.sendto(header + channel.encode() + b"\0" + message.encode(), (GROUP, PORT))
        self.sent += 1

    def received(self, channel):
        """The newest message on a channel that has come since the last call, as bytes, or None."""
        newest = None
        while True:
            try:
                data = self.inp.recv(65536)
            except BlockingIOError:
                return newest
            name, zero, payload = data[8:].partition(b"\0")
            if zero and name.decode() == channel:
                newest = payload


def motion_at(t_s):
    """x, y (east, north), yaw, speed, path: at rest for STAND_S, then around a circle."""
    t = max(0.0, t_s - STAND_S)
    up = min(t, SPEED_MPS / ACCEL_MPS2)
    path = 0.5 * ACCEL_MPS2 * up * up + SPEED_MPS * (t - up)
    yaw = path / RADIUS_M
    return RADIUS_M * math.sin(yaw), RADIUS_M * (1.0 - math.cos(yaw)), yaw, ACCEL_MPS2 * up, path


def main():
    length_s = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    bus, noise = Bus(), random.Random(1)
    ins, fix, wheels = rcs.ins_t(), rcs.gps_fix_t(), rcs.odometry_t()
    ins.publisher_id = fix.publisher_id = wheels.publisher_id = os.getpid()
    newest = None
    begin_us = time.monotonic_ns() // 1000  # one clock for all sensors
    for k in range(1, int(length_s * 1e6 / TICK_US) + 1):
        time.sleep(max(0.0, 1e-6 * (begin_us + k * TICK_US) - time.monotonic()))
        utime, t, dt = begin_us + k * TICK_US, 1e-6 * k * TICK_US, 1e-6 * TICK_US
        x, y, yaw, speed, path = motion_at(t)
        before = motion_at(t - dt)

        ins.utime, ins.interval_us, ins.valid, ins.seq = utime, TICK_US, 1, ins.seq + 1
        # WM rejects increments that repeat: a sensor without noise is faulty.
        ins.delta_angle_rad = [0.0, 0.0, yaw - before[2] + noise.gauss(0.0, 1e-6)]
        ins.delta_v_mps = [speed - before[3], speed * speed / RADIUS_M * dt, GRAVITY_MPS2 * dt]
        bus.publish("INS", ins)

        if k % 20 == 0:
            wheels.utime, wheels.interval_us, wheels.seq = utime, 20 * TICK_US, wheels.seq + 1
            wheels.speed_mps = (path - motion_at(t - 20 * dt)[4]) / (20 * dt)
            wheels.yaw_rate_radps = wheels.speed_mps / RADIUS_M
            wheels.sigma_speed_mps, wheels.sigma_yaw_rate_radps = 0.05, 0.02
            bus.publish("ODOMETRY", wheels)
        if k % 40 == 0:
            lat = math.radians(40.0)
            w2 = 1.0 - 6.69438e-3 * math.sin(lat) ** 2
            north = y + LEVER_M[0] * math.sin(yaw) + noise.gauss(0.0, 0.02)
            east = x + LEVER_M[0] * math.cos(yaw) + noise.gauss(0.0, 0.02)
            fix.utime, fix.seq, fix.fix_type = utime, fix.seq + 1, rcs.gps_fix_t.FIX_FIXED
            fix.lat_deg = 40.0 + math.degrees(north / (6378137.0 * (1.0 - 6.69438e-3) / w2 ** 1.5))
            fix.lon_deg = -77.0 + math.degrees(east / (6378137.0 / math.sqrt(w2) * math.cos(lat)))
            fix.height_m = 200.0 + LEVER_M[1] + noise.gauss(0.0, 0.03)
            fix.height_kind, fix.undulation_m = rcs.gps_fix_t.HEIGHT_ELLIPSOIDAL, math.nan
            fix.sigma_enu_m, fix.satellites, fix.hdop, fix.vdop = [0.02, 0.02, 0.03], 14, 0.8, 1.2
            bus.publish("GPS_FIX", fix)
        newest = bus.received("WM_NAV_STATE") or newest
        if k % 200 == 0 and newest:
            nav = rcs.nav_state_t.decode(newest)
            x, y = motion_at(1e-6 * (nav.utime - begin_us))[:2]
            where = "world" if nav.world_valid else "local"  # local: no heading yet
            print("%5.1f s, %s, mode %s: %7.2f %7.2f %6.2f m; truth %7.2f %7.2f" %
                  (t, where, MODES[nav.mode], *nav.p_world_vehicle_m, x, y), flush=True)


if __name__ == "__main__":
    main()
