# Sourced by deploy/prove-install: the package's life, in a bare root that systemd boots.

pass() { printf 'deploy/prove-install: ok    %s\n' "$*"; }
failures=0
miss() { printf 'deploy/prove-install: FAIL  %s\n' "$*" >&2; failures=$((failures + 1)); }
# check WORDS COMMAND...: says whether the command is true.
check() { local words=$1; shift; if "$@" >/dev/null 2>&1; then pass "$words"; else miss "$words"; fi; }
check_not() { local words=$1; shift; if "$@" >/dev/null 2>&1; then miss "$words"; else pass "$words"; fi; }

milliseconds() { echo $(($(date +%s%N) / 1000000)); }

# A later version of the same, whose configuration file has changed, too.
make_later() {
  local work
  work=$(mktemp -d)
  dpkg-deb -R "$1" "$work"
  sed -i 's/^Version: \(.*\)$/Version: \1+later/' "$work/DEBIAN/control"
  echo '# of a later version' >>"$work/etc/saccade/saccade.toml"
  dpkg-deb --root-owner-group -b "$work" "$root/opt/later.deb" >/dev/null
  rm -rf "$work"
}

# systemd as process 1, in a network of its own that has loopback alone. It wants a /run that is no disk.
boot() {
  local i
  unshare -m bash -c 'mount --make-rprivate / && mount -t tmpfs tmpfs /run && exec systemd-nspawn \
    --quiet -D "$1" --register=no --keep-unit --private-network --boot' nspawn "$root" \
    </dev/null >"$root.boot.log" 2>&1 &
  nspawn=$!
  trap 'power_off; unmount_all' EXIT
  for ((i = 0; i < 600; i++)); do
    leader=$(pgrep -P "$nspawn" -x systemd || true)
    if [ -n "$leader" ] && grep -q 'login:' "$root.boot.log"; then return; fi
    kill -0 "$nspawn" 2>/dev/null || break
    sleep 0.1
  done
  tail -5 "$root.boot.log" >&2
  fail "systemd does not boot in $root; see $root.boot.log"
}
power_off() {
  local i
  [ -n "${leader:-}" ] || return 0
  kill -RTMIN+4 "$leader" 2>/dev/null || true  # systemd's poweroff.target
  for ((i = 0; i < 200; i++)); do kill -0 "$nspawn" 2>/dev/null || return 0; sleep 0.1; done
  kill -KILL "$leader" 2>/dev/null || true
}
# A command there.
within() {
  nsenter --target "$leader" --mount --uts --ipc --net --pid --cgroup --root --wd -- \
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"
}

# Until `saccade status` of the booted root matches $1, at most $2 s; with further arguments.
await_status() {
  local pattern=$1 i
  for ((i = 0; i < $2 * 10; i++)); do
    if within saccade "${@:3}" --json status 2>/dev/null | grep -Eq "$pattern"; then return 0; fi
    sleep 0.1
  done
  return 1
}
set_key() { sed -i "s|^$1 = .*|$1 = \"$2\"|" "$root/etc/saccade/saccade.toml"; }
# Nobody is there to be asked: an edited file is kept.
apt_within() { within apt-get -y -qq -o Dpkg::Use-Pty=0 -o Dpkg::Options::=--force-confdef -o Dpkg::Options::=--force-confold "$@" >>"$root.apt.log" 2>&1; }

prove_install_and_serve() {
  local began installed tracked
  began=$(milliseconds)
  apt_within install --no-install-recommends ./opt/saccade.deb || fail "apt cannot install it, see $root.apt.log"
  installed=$(milliseconds)
  await_status '"status": "tracking"' 60 || miss "no frame is tracked within 60 s"
  tracked=$(milliseconds)
  printf 'deploy/prove-install: apt install %d.%01d s (packages were downloaded before), first tracked frame %d.%01d s after it began\n' \
    $(((installed - began) / 1000)) $(((installed - began) % 1000 / 100)) \
    $(((tracked - began) / 1000)) $(((tracked - began) % 1000 / 100))
  check "the service is enabled" within systemctl is-enabled saccade
  check "it runs as saccade" within sh -c '[ "$(ps -o user= -C saccade-server)" = saccade ]'
  check_not "nothing listens beyond loopback" within sh -c 'ss -Hltn | grep -v "127.0.0.1:"'
  check "the page is served" within sh -c 'curl -fs http://127.0.0.1:8080/ | grep -qi "<html"'
  check "state is its own alone" within sh -c '[ "$(stat -c %U:%a /var/lib/saccade)" = saccade:700 ]'
  check "its file is root's, and the service's to read" within sh -c '[ "$(stat -c %U:%G:%a /etc/saccade/saccade.toml)" = root:saccade:640 ]'
  check "its account has no shell and no password" within sh -c 'getent passwd saccade | grep -q "nologin$" && getent shadow saccade | cut -d: -f2 | grep -q "^[!*]"'
  check "a mark can be placed" within saccade annotate --point 0.1,0.1,1.5 --shape arrow --text kept
  within systemd-analyze --no-pager verify /usr/lib/systemd/system/saccade.service 2>&1 | sed 's/^/  verify: /'
  within systemd-analyze --no-pager security saccade 2>&1 | tail -1
}

# What a service may that is shut in like this one: decode a video, and nothing it was not given.
prove_sandbox() {
  local properties
  command -v ffmpeg >/dev/null || { printf 'deploy/prove-install: no ffmpeg here: file: not tried\n'; return; }
  mkdir -p "$root/srv"
  ffmpeg -v error -y -f lavfi -i testsrc=duration=120:size=320x240:rate=30 -c:v mpeg4 "$root/srv/video.mp4"
  set_key source file:/srv/video.mp4
  within systemctl restart saccade
  check "a video is decoded in the service" await_status '"captured_fps_hz": [1-9]' 20
  check "by saccade-decode" within pgrep -x saccade-decode
  properties=$(within systemctl show saccade -p ExecStart,User,ProtectSystem,NoNewPrivileges)
  check "the unit's own command line" grep -q 'argv\[\]=/usr/bin/saccade-server --config /etc/saccade/saccade.toml ' <<<"$properties"
  set_key source sim:desk
}

prove_tls() {
  local address=https://127.0.0.1:8443 link
  set_key http 0.0.0.0:8443
  set_key grpc 0.0.0.0:50051
  within systemctl restart saccade
  local owner=(runuser -u saccade -- saccade --data-dir /var/lib/saccade)
  check "the root is exported" wait_for 30 within sh -c "runuser -u saccade -- saccade --data-dir /var/lib/saccade trust >/tmp/root.pem"
  check "the page opens over TLS with it" wait_for 30 within sh -c "curl -fs --cacert /tmp/root.pem $address/ | grep -qi '<html'"
  check "the phone's page on trust does" within sh -c "curl -fs --cacert /tmp/root.pem $address/trust | grep -qi '<html'"
  check "so does the wearer's" within sh -c "curl -fs --cacert /tmp/root.pem $address/wearer | grep -qi '<html'"
  check_not "without the root it does not" within curl -fs $address/
  check_not "without an invite nobody comes in" within saccade --tls --trust /tmp/root.pem status
  link=$(within "${owner[@]}" invite --role pilot | grep -o 'https://[^ ]*' | head -1)
  check "an invite is made (${link%%#*})" test -n "$link"
  # Once: it lets one in, and the pass is kept.
  check "keys, invites and marks are its own alone" within sh -c '[ -s /var/lib/saccade/access.sqlite ] && [ -z "$(find /var/lib/saccade -mindepth 1 -perm /077)" ]'
  check_not "another account reads no token" within runuser -u nobody -- cat /var/lib/saccade/owner.json
  check_not "nor stops the service" within runuser -u nobody -- pkill saccade-server
  check "who has it comes in" within env HOME=/tmp/guest saccade --tls --trust /tmp/root.pem --invite "$link" status
  check "and sees what is tracked" wait_for 30 within env HOME=/tmp/guest sh -c 'saccade --json status | grep -q "\"status\": \"tracking\""'
}
wait_for() {
  local i seconds=$1
  shift
  for ((i = 0; i < seconds * 5; i++)); do if "$@" 2>/dev/null; then return 0; fi; sleep 0.2; done
  return 1
}

prove_upgrade_and_removal() {
  set_key http 127.0.0.1:8181
  set_key grpc 127.0.0.1:50051
  local before
  before=$(within systemctl show -p MainPID --value saccade)
  apt_within install ./opt/later.deb ||
    miss "the upgrade failed, see $root.apt.log"
  check "upgraded" within sh -c 'dpkg-query -W -f "\${Version}" saccade | grep -q later'
  check "the edited file is kept" grep -q 127.0.0.1:8181 "$root/etc/saccade/saccade.toml"
  check "the new one lies beside it" test -f "$root/etc/saccade/saccade.toml.dpkg-dist"
  check "the service runs anew" within sh -c "[ \$(systemctl show -p MainPID --value saccade) != $before ]"
  check "and serves what the edited file says" wait_for 20 within curl -fs -o /dev/null http://127.0.0.1:8181/
  check "the mark is still there" wait_for 20 within sh -c 'saccade annotations | grep -q kept'
  apt_within remove saccade || miss "the removal failed"
  check_not "removed, nothing runs" within pgrep saccade
  check "state is kept" test -s "$root/var/lib/saccade/tls/authority.key"
  check "so is the file" test -f "$root/etc/saccade/saccade.toml"
  apt_within install --no-install-recommends ./opt/saccade.deb || miss "it cannot be installed again"
  check "installed again, the mark is still there" wait_for 20 within sh -c 'saccade annotations | grep -q kept'
  apt_within purge saccade || miss "the purge failed"
  check_not "purged, nothing runs" within pgrep saccade
  local left
  left=$(find "$root/etc" "$root/var" "$root/usr" -xdev -iname '*saccade*' -not -path '*/var/log/*' -not -path '*/var/cache/apt/*' || true)
  check "nothing is left of it: ${left:-no file}" test -z "$left"
  check_not "the user is gone" within getent passwd saccade
}

# Somebody called saccade works on this machine: the service does not become that person.
prove_foreign_account() {
  within useradd --create-home saccade
  if apt_within install --no-install-recommends ./opt/saccade.deb; then miss "it took a person's account"; fi
  check "a person's account is refused, in words" grep -q 'there is an account named saccade that is not' "$root.apt.log"
  check_not "nothing runs as that person" within pgrep -u saccade
  apt_within purge saccade || miss "what was refused cannot be purged"
  check "the person is still there" within sh -c 'getent passwd saccade | grep -q /home/saccade && [ -d /home/saccade ]'
  within userdel -r saccade || true
}

prove_package() {
  local deb=${1:-}
  command -v systemd-nspawn >/dev/null || fail "systemd-nspawn is missing: apt-get install systemd-container"
  if [ -z "$deb" ]; then deb=$("$repository/deploy/package" | tail -1); deb=$(realpath "$repository/$deb"); fi
  [ -f "$deb" ] || fail "$deb: no such package"
  : >"$root.apt.log"
  inside_root() { chroot "$root" env -i "${environment[@]}" DEBIAN_FRONTEND=noninteractive "$@" </dev/null >>"$root.apt.log" 2>&1; }
  # What any Debian has and a bare one lacks; procps, iproute2 and curl look at the result.
  inside_root apt-get update -qq && inside_root apt-get install -y -qq --no-install-recommends systemd systemd-sysv dbus \
    procps iproute2 curl ca-certificates || fail "the root cannot be prepared, see $root.apt.log"
  inside_root apt-get purge -y -qq saccade || true
  rm -rf "$root/root" "$root/tmp"
  mkdir -m 700 "$root/root" && mkdir -m 1777 "$root/tmp"
  cp "$deb" "$root/opt/saccade.deb"
  make_later "$deb"
  local started=$SECONDS
  inside_root apt-get install -y -qq --no-install-recommends --download-only /opt/saccade.deb ||
    fail "its dependencies cannot be downloaded, see $root.apt.log"
  elapsed "downloading what it needs" $((SECONDS - started))
  unmount_all
  boot
  prove_install_and_serve
  prove_sandbox
  prove_tls
  prove_upgrade_and_removal
  prove_foreign_account
  power_off
  leader=
  [ $failures = 0 ] || fail "$failures of it failed; logs: $root.*.log"
  pass "all of it"
}
