#include "loaded_curl.hpp"

#include "core/text.hpp"

#include <dlfcn.h>

namespace webots_cloud::adapters {
namespace {

template<class Function>
bool find(void* library, Function& function, char const* name)
{
    function = reinterpret_cast<Function>(::dlsym(library, name));
    return function != nullptr;
}

} // namespace

result<LoadedCurl> LoadedCurl::load(std::string const& name)
{
    LoadedCurl curl;
    void* const library = ::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    bool const complete = library && find(library, curl.global_init, "curl_global_init") &&
                          find(library, curl.easy_init, "curl_easy_init") &&
                          find(library, curl.easy_setopt, "curl_easy_setopt") &&
                          find(library, curl.easy_getinfo, "curl_easy_getinfo") &&
                          find(library, curl.easy_strerror, "curl_easy_strerror") &&
                          find(library, curl.easy_cleanup, "curl_easy_cleanup") &&
                          find(library, curl.multi_init, "curl_multi_init") &&
                          find(library, curl.multi_add_handle, "curl_multi_add_handle") &&
                          find(library, curl.multi_remove_handle, "curl_multi_remove_handle") &&
                          find(library, curl.multi_perform, "curl_multi_perform") &&
                          find(library, curl.multi_poll, "curl_multi_poll") &&
                          find(library, curl.multi_wakeup, "curl_multi_wakeup") &&
                          find(library, curl.multi_info_read, "curl_multi_info_read") &&
                          find(library, curl.multi_strerror, "curl_multi_strerror") &&
                          find(library, curl.multi_cleanup, "curl_multi_cleanup") &&
                          find(library, curl.slist_append, "curl_slist_append") &&
                          find(library, curl.slist_free_all, "curl_slist_free_all");
    if (!complete)
        return Failure(errc::unavailable,
                       core::concat("e-mail needs libcurl (package libcurl4): ", ::dlerror()));
    curl.global_init(CURL_GLOBAL_DEFAULT);
    return curl;
}

} // namespace webots_cloud::adapters
