// Files that grow line by line, such as monitor.csv.
#pragma once

#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

namespace webots_cloud::adapters {

/// A file that grows line by line, written by a thread of its own: the function it returns never blocks.
/// Copies share the file.
///
/// Before a line that would make it longer than `max_bytes` the file becomes `<file>.1`, in place of the one
/// before, and a new one begins with `first_line`. The default is some three days of lines of 60 bytes, one a
/// second.
///
/// An existing file is emptied; folders are made. A file that can't be opened or written costs one line of
/// the log, which calls it `name`, and then lines are dropped; the function is empty when it could not even
/// be opened.
std::function<void(std::string line)> make_line_file(boost::asio::any_io_executor executor, std::string name,
                                                     std::filesystem::path file, std::string first_line,
                                                     Logger log, std::size_t max_bytes = 16'000'000);

} // namespace webots_cloud::adapters
