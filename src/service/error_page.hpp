// Refusals as people see them who opened an address in a browser.
#pragma once

#include <webots_cloud/transport/endpoint.hpp>

namespace webots_cloud {

/// Puts the sentence of a refusal into a page that looks like our others, where a browser opens it as a page,
/// in the language that the browser asks for if the sentence is in src/web/viewer/error.json.
/// Programs, and scripts of pages, get the sentence alone, to the byte what they have always got.
void dress_for_people(HttpResponse& response, IncomingRequest const& request);

} // namespace webots_cloud
