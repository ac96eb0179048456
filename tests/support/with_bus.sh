#!/bin/sh
# with_bus.sh COMMAND [ARG...]: runs the command on a private LCM bus, i.e. in a network namespace of
# its own with a multicast route, so that tests can run in parallel and next to a vehicle's bus.
# Where the system forbids namespaces it reports that and exits with 77 (CTest: skipped).

# A test program that lists its tests needs no bus; within a private bus no second one is created.
case " $* " in *" --gtest_list_tests "*) exec "$@" ;; esac
[ -n "$RCS_PRIVATE_BUS" ] && exec "$@"

route='ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo'
for flags in -rn -n; do # as a user with user namespaces; as root where those are switched off
  if unshare $flags sh -c "$route" 2>/dev/null; then
    exec env RCS_PRIVATE_BUS=1 unshare $flags sh -c "$route"' && exec "$@"' with_bus "$@"
  fi
done
echo "SKIPPED, NOT TESTED: $*: no private bus. This system allows neither 'unshare -rn' nor" \
  "'unshare -n', or iproute2 is missing." >&2
exit 77
