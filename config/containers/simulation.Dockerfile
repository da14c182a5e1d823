# The simulation server in a container, with the demo simulator in place of Webots, and Python for the programs of its robots.
# config/containers/build.sh calls this; docs/clusters.md says how it is run, and how Webots is added.
ARG BASE=debian:bookworm-slim

FROM ${BASE} AS root
COPY *.deb /packages/
RUN set -eux; \
    export DEBIAN_FRONTEND=noninteractive; \
    apt-get update; \
    apt-get upgrade --yes; \
    apt-get install --yes --no-install-recommends systemd-standalone-sysusers ca-certificates tini \
        bubblewrap iproute2 slirp4netns python3 /packages/*.deb; \
    useradd --uid 10001 --user-group --no-create-home --home-dir /var/lib/webots-cloud --shell /usr/sbin/nologin webots; \
    mkdir -p /var/lib/webots-cloud /run/webots-cloud; \
    rm -rf /packages /var/lib/apt/lists/* /var/cache/* /var/log/* /usr/share/man /usr/share/locale /usr/share/info; \
    # Nobody is to become somebody else in here.
    find / -xdev -type f -perm /6000 -exec chmod a-s {} +
COPY simulation.json /etc/webots-cloud/simulation.json

# One layer, without what was deleted.
FROM scratch
COPY --from=root / /
RUN chown 10001:10001 /var/lib/webots-cloud /run/webots-cloud
ARG VERSION=unknown
ARG REVISION=unknown
LABEL org.opencontainers.image.title="Webots simulation server" \
      org.opencontainers.image.description="Runs Webots simulations for browsers; with a demo simulator, without Webots" \
      org.opencontainers.image.licenses="Apache-2.0" \
      org.opencontainers.image.version="${VERSION}" \
      org.opencontainers.image.revision="${REVISION}"
USER 10001:10001
WORKDIR /var/lib/webots-cloud
ENV HOME=/var/lib/webots-cloud
EXPOSE 2000
# Of a server that does not speak TLS itself.
HEALTHCHECK --interval=10s --timeout=5s --start-period=10s \
    CMD ["bash", "-c", "exec 3<>/dev/tcp/127.0.0.1/2000; printf 'GET /livez HTTP/1.0\\r\\nHost: localhost\\r\\n\\r\\n' >&3; read -r _ status _ <&3; [[ $status == 200 ]]"]
# tini takes care of processes whose guard was killed.
ENTRYPOINT ["/usr/bin/tini", "--", "/usr/bin/webots-simulation-server"]
CMD ["/etc/webots-cloud/simulation.json"]
