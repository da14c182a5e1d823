// The real transports: every adapter is reached through a function of one of these headers, and the library
// behind it stays hidden.
#pragma once

#include <webots_cloud/adapters/controller_server.hpp>
#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/http_client.hpp>
#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/adapters/logs.hpp>
#include <webots_cloud/adapters/mail.hpp>
#include <webots_cloud/adapters/names.hpp>
#include <webots_cloud/adapters/operator.hpp>
#include <webots_cloud/adapters/processes.hpp>
#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/adapters/secrets.hpp>
