// Pages that all who ask for them share, so that asking costs the server next to nothing.
#pragma once

#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/http.hpp>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::core {

/// How long clients may keep an answer without asking again.
enum class Kept
{
    until_asked, ///< They ask each time; the answer is short when nothing has changed.
    for_ever     ///< The address names the contents.
};

/// A body and the tag by which clients recognize it.
class SharedPage
{
public:
    SharedPage() = default;

    /// Its text from now on, and the same compressed where that is at hand. The same text stays the same
    /// body, compressed as it may be.
    void set(std::string text, std::string gzip = {});

    bool empty() const noexcept { return !body_; }

    /// 200 with the body, or 304 for a client that has it: `if_none_match` is its header of that name.
    /// Precondition: not empty.
    HttpResponse answer(std::string_view content_type, std::string_view if_none_match,
                        Kept kept = Kept::until_asked) const;

private:
    std::shared_ptr<SharedBody const> body_;
    std::string tag_;
};

/// A page that shows what changes: made anew once a second at most, however often it is asked for.
class TimedPage
{
public:
    static constexpr auto lifetime = std::chrono::seconds(1);

    TimedPage() = default;

    /// The page of this second; `make` returns its text.
    template<class Make>
    SharedPage const& get(TimePoint now, Make const& make)
    {
        if (!made_ || now - *made_ >= lifetime) {
            page_.set(make());
            made_ = now;
        }
        return page_;
    }

    /// Something has changed that whoever changed it wants to see at once.
    void expire() noexcept { made_.reset(); }

private:
    SharedPage page_;
    std::optional<TimePoint> made_;
};

} // namespace webots_cloud::core
