// The functions of libcurl that mails need, loaded at run time: it brings 27 other libraries and 4 MB of
// resident memory, and a session server that sends no mails needs none of them.
#pragma once

#include <webots_cloud/error.hpp>

#include <curl/curl.h>

#include <string>

namespace webots_cloud::adapters {

/// Named as in curl.h, without `curl_`.   Thread-safety: any thread.
struct LoadedCurl
{
    /// Never unloaded: its threads may still be inside.   Errors: `unavailable`, with the dynamic linker's
    /// message.
    static result<LoadedCurl> load(std::string const& name = "libcurl.so.4");

    decltype(&::curl_global_init) global_init = nullptr;
    decltype(&::curl_easy_init) easy_init = nullptr;
    decltype(&::curl_easy_setopt) easy_setopt = nullptr;
    decltype(&::curl_easy_getinfo) easy_getinfo = nullptr;
    decltype(&::curl_easy_strerror) easy_strerror = nullptr;
    decltype(&::curl_easy_cleanup) easy_cleanup = nullptr;
    decltype(&::curl_multi_init) multi_init = nullptr;
    decltype(&::curl_multi_add_handle) multi_add_handle = nullptr;
    decltype(&::curl_multi_remove_handle) multi_remove_handle = nullptr;
    decltype(&::curl_multi_perform) multi_perform = nullptr;
    decltype(&::curl_multi_poll) multi_poll = nullptr;
    decltype(&::curl_multi_wakeup) multi_wakeup = nullptr;
    decltype(&::curl_multi_info_read) multi_info_read = nullptr;
    decltype(&::curl_multi_strerror) multi_strerror = nullptr;
    decltype(&::curl_multi_cleanup) multi_cleanup = nullptr;
    decltype(&::curl_slist_append) slist_append = nullptr;
    decltype(&::curl_slist_free_all) slist_free_all = nullptr;

private:
    LoadedCurl() = default;
};

} // namespace webots_cloud::adapters
