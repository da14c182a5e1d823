// The Dockerfiles of projects, of which nothing is believed.
#pragma once

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// What the Dockerfile of a project may start from and copy from, besides its own stages, `scratch` and
/// images that are named with their registry.
struct DockerfileTerms
{
    DockerfileTerms() = default;

    std::string images;        ///< The operator's: a repository.
    std::string default_image; ///< The value of `WEBOTS_DEFAULT_IMAGE`.
    std::string server;        ///< The label of what is built.
};

/// What is built for a project.
struct ProjectDockerfile
{
    ProjectDockerfile() = default;

    std::string text;
    bool says_what_to_start = false; ///< By ENTRYPOINT or CMD in its last stage.
    /// The images of registries that its stages start from: nobody here has read what they have docker do.
    std::vector<std::string> bases;
};

/// The Dockerfile to build with in place of `text`: the instructions of `text`, each in one line, without
/// comments. So docker, whose versions read line ends, comments and escapes differently, reads in it what we
/// have read. Other images of this machine, those of other simulations among them, can't be named.
///
/// Whatever an instruction says of labels, the next step has the server as a label and no labels of
/// compose's: so a container in which a build has failed is found, and taken for no other. `file` is its
/// name, for the person who reads the error.
///
/// Errors: `invalid_argument`, with a sentence that names the line.
result<ProjectDockerfile> project_dockerfile(std::string_view text, std::string_view file,
                                             DockerfileTerms const& terms);

/// The arguments of docker that print, for `has_triggers`, what an image has docker do in builds that start
/// from it (ONBUILD).
std::vector<std::string> list_triggers(std::string_view image);
bool has_triggers(std::string_view listing);

} // namespace webots_cloud::core
