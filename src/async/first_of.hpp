// Several parts of a service that run at once, and end together.
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/asio/awaitable.hpp>

#include <concepts>
#include <utility>
#include <vector>

namespace webots_cloud::async {

/// A part of a service: it runs until it is cancelled, or fails.
using Part = boost::asio::awaitable<result<>>;

/// What ends without a result, as a part.
Part as_part(boost::asio::awaitable<void> body);

/// Runs all parts, at least one. The first that ends cancels the others, which are awaited; the result is
/// that of the first, or its exception.
///
/// They begin in their order, when the returned coroutine is awaited. An executor's turn may end more than
/// one: then the results of the others are lost.
///
/// Cancellation: terminal; cancels all.
Part first_of(std::vector<Part> parts);

/// The same for parts that are known by name. A chain of Asio's `||` would do, but has the compiler write
/// each of its links anew, with a variant of all results: 14 s for a server of 13 parts.
template<std::same_as<Part>... Parts>
Part first_of(Part first, Parts... others)
{
    std::vector<Part> parts;
    parts.reserve(1 + sizeof...(others));
    parts.push_back(std::move(first));
    (parts.push_back(std::move(others)), ...);
    return first_of(std::move(parts));
}

} // namespace webots_cloud::async
