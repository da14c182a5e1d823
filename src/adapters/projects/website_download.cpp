#include "website_download.hpp"

#include "adapters/files/project_files.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"

#include <boost/asio/error.hpp>

#include <fcntl.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

using core::concat;

constexpr std::size_t judged = 512; // bytes of an answer that tell what it is

/// Nothing of it is left, however this ends.
result<FileDescriptor> make_nameless_file(int folder)
{
    constexpr auto* name = ".download";
    FileDescriptor file(::openat(folder, name, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (!file || ::unlinkat(folder, name, 0) != 0)
        return disk_failure();
    return file;
}

/// What an answer becomes while it arrives.
struct Answer
{
    result<> operator()(std::string_view bytes)
    {
        beginning.append(bytes.substr(0, judged - std::min(judged, beginning.size())));
        progress.bytes_received += bytes.size();
        FetchBytes price;
        price.disk = bytes.size();
        if (auto const taken = share.take(price); !taken)
            return taken;
        return write_all(file, bytes);
    }

    int file;
    FetchShare& share;
    FetchProgress& progress;
    std::string beginning{};
};

/// What went wrong on the way, as a sentence.
Failure explain(Failure const& failure, std::string const& host)
{
    if (failure.code() == boost::asio::error::operation_aborted)
        return failure;
    return core::refused(failure.code(), core::Refused::website_unreachable,
                         {{"host", host}, {"words", failure.message()}});
}

} // namespace

result<std::optional<FileDescriptor>> download_archive(CurlHttp& http, WebsiteProject const& project,
                                                       core::DownloadRequest const& request,
                                                       CurlLimits const& limits, int folder,
                                                       FetchShare& share, FetchProgress& progress)
{
    auto file = make_nameless_file(folder);
    if (!file)
        return file.error();
    progress.bytes_received = 0;
    Answer answer{file->get(), share, progress};
    CurlRequest question;
    question.peer = "the website";
    question.base = project.origin;
    question.url = request.url;
    question.agent = "webots_cloud";
    question.headers.push_back(concat("Content-Type: ", core::form_type));
    question.body = request.form;
    question.sink = std::ref(answer);
    bool stopped_by_sink = false; // it has sentences
    question.stopped_by_sink = &stopped_by_sink;
    auto const status = http.send(question, limits);
    if (!status)
        return stopped_by_sink ? status.error() : explain(status.error(), project.host());
    if (*status != 200)
        return core::refused(core::Refused::website_status,
                             {{"host", project.host()}, {"status", std::to_string(*status)}});
    switch (core::classify_download(answer.beginning)) {
    case core::DownloadAnswer::unchanged:
        return std::optional<FileDescriptor>();
    case core::DownloadAnswer::refused:
        return core::download_refusal(answer.beginning);
    case core::DownloadAnswer::archive:
        break;
    }
    return std::optional(std::move(*file));
}

} // namespace webots_cloud::adapters
