// What people are told when large files can't be had: what a status of an LFS server, or a failure on the way
// to it, means for them, and what helps.
#pragma once

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Makes the sentences about the large files of one repository. A file is named by its `path`, as it is to
/// be shown.
struct LfsProblems
{
    std::string repository; ///< `owner/name`.
    std::string forge;      ///< Its address.

    /// What libcurl, a parser or a rule says, as a sentence.
    Failure explain(Failure const& failure) const;

    /// A status of the answer to the question for objects.
    Failure about_batch(int status) const;

    /// What became of one: a status of its own, or of the request for it; 0: there is none. `words`: what the
    /// server says of it.
    Failure about_object(std::string_view path, int status, std::string_view words) const;

    /// The server sends something that is not what the pointer names.
    Failure about_content(std::string_view path) const;

    /// Its pointer names a program that would have to make the file of what is stored.
    Failure about_extension(std::string_view path) const;

private:
    Failure failed(boost::system::error_code code, std::string_view why, std::string_view advice) const;
};

} // namespace webots_cloud::core
