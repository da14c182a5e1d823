#include "controller_compiler.hpp"

namespace webots_cloud::core {

std::filesystem::path common_makefile(std::filesystem::path const& home)
{
    return home / "resources/Makefile.include";
}

std::vector<std::string> compile_command(ControllerCompiler const& compiler, ControllerSources const& sources)
{
    // A folder of another user can't be our working directory.
    std::vector<std::string> command{compiler.make.native(), "--no-print-directory", "-C",
                                     sources.folder.native()};
    if (!sources.has_makefile)
        command.insert(command.end(), {"-f", common_makefile(compiler.home).native()});
    return command;
}

std::vector<std::pair<std::string, std::string>> compile_variables(ControllerCompiler const& compiler)
{
    return {{"WEBOTS_HOME", compiler.home.native()}, {"LC_ALL", "C"}};
}

} // namespace webots_cloud::core
