# The session server in a container. config/containers/build.sh calls this; docs/clusters.md says how it is run.
ARG BASE=debian:bookworm-slim

FROM ${BASE} AS root
COPY *.deb /packages/
RUN set -eux; \
    export DEBIAN_FRONTEND=noninteractive; \
    apt-get update; \
    apt-get upgrade --yes; \
    apt-get install --yes --no-install-recommends systemd-standalone-sysusers ca-certificates /packages/*.deb; \
    useradd --uid 10001 --user-group --no-create-home --home-dir /var/lib/webots-cloud --shell /usr/sbin/nologin webots; \
    mkdir -p /var/lib/webots-cloud /run/webots-cloud; \
    rm /etc/webots-cloud/session.json; \
    rm -rf /packages /var/lib/apt/lists/* /var/cache/* /var/log/* /usr/share/man /usr/share/locale /usr/share/info; \
    # Nobody is to become somebody else in here.
    find / -xdev -type f -perm /6000 -exec chmod a-s {} +

# One layer, without what was deleted.
FROM scratch
COPY --from=root / /
RUN chown 10001:10001 /var/lib/webots-cloud /run/webots-cloud
ARG VERSION=unknown
ARG REVISION=unknown
LABEL org.opencontainers.image.title="Webots session server" \
      org.opencontainers.image.description="Sends browsers to machines that run Webots simulations" \
      org.opencontainers.image.licenses="Apache-2.0" \
      org.opencontainers.image.version="${VERSION}" \
      org.opencontainers.image.revision="${REVISION}"
USER 10001:10001
WORKDIR /var/lib/webots-cloud
ENV HOME=/var/lib/webots-cloud
EXPOSE 1999
# Of a server that does not speak TLS itself.
HEALTHCHECK --interval=10s --timeout=5s --start-period=10s \
    CMD ["bash", "-c", "exec 3<>/dev/tcp/127.0.0.1/1999; printf 'GET /livez HTTP/1.0\\r\\nHost: localhost\\r\\n\\r\\n' >&3; read -r _ status _ <&3; [[ $status == 200 ]]"]
ENTRYPOINT ["/usr/bin/webots-session-server"]
CMD ["/etc/webots-cloud/session.json"]
