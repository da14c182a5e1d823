// The programs of a project that its page may show, change and compile. They are read once, before a
// simulator could change them; what is saved goes into the project's folder, and into copies of it elsewhere.
// Decisions: core/simulation/editable_files, core/projects/lesson.
#include "simulation_programs.hpp"

#include "async/cancellation.hpp"
#include "core/projects/lesson.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr std::string_view folder_name = "controllers"; // of a project

} // namespace

/// Takes the programs and the lesson as they were fetched, before a simulator runs that could have changed
/// them.
asio::awaitable<void> SimulationPrograms::read()
{
    auto* const files = context_.hooks.program_files;
    if (!files || !context_.config.allow_edit)
        co_return;
    TextLimits limits;
    limits.bytes = core::largest_editable;
    limits.files = core::most_editable;
    auto found = co_await files->read_all(project_->root / folder_name, limits);
    core::EditableFiles::Texts texts;
    if (found)
        for (auto& [name, text] : *found)
            texts.emplace(std::move(name), std::move(text));
    auto const world = project_->world.lexically_relative(project_->root).generic_string();
    auto const lesson = core::lesson_file(world);
    std::vector<std::string> names{world, lesson};
    auto const read = co_await files->read(project_->root, std::move(names));
    bool const is_there = read && read->front();
    files_.emplace(std::move(texts), is_there ? std::string_view(*read->front()) : std::string_view());
    if (!read || !read->back())
        co_return;
    auto const parsed = core::parse_lesson(*read->back());
    lesson_ = parsed ? core::lesson_message(*parsed) : core::lesson_left_out_message(lesson, parsed.error());
}

void SimulationPrograms::forget()
{
    files_.reset();
    lesson_.clear();
}

void SimulationPrograms::list(Channel& channel) const
{
    if (files_ && !files_->empty())
        (void)channel.send(files_->list_message());
    if (files_ && can_compile())
        if (auto const controllers = files_->compiled_controllers(); !controllers.empty())
            (void)channel.send(core::compiles_message(controllers));
    if (!lesson_.empty())
        (void)channel.send(lesson_);
}

void SimulationPrograms::show(core::ReadFileMessage const& wish, Channel& channel) const
{
    auto const text =
        files_ ? files_->read(wish.file, wish.original) : core::refused(core::Refused::not_editable);
    (void)channel.send(text ? core::file_message(wish.file, *text, wish.original)
                            : core::file_error_message(wish.file, text.error()));
}

asio::awaitable<void> SimulationPrograms::save(core::WriteFileMessage program, Channel& channel)
{
    auto const [file, text] = std::move(program);
    auto saved = files_ ? files_->may_save(file, text, context_.clock.now())
                        : core::refused(core::Refused::not_editable);
    if (saved) {
        std::vector<TextFile> files{TextFile(concat(folder_name, "/", file), text)};
        saved = co_await context_.hooks.program_files->write(project_->root, std::move(files));
    }
    if (saved && simulation_) {
        auto path = project_->root / folder_name / file;
        saved = co_await simulation_->put_back(std::move(path));
    }
    if (saved)
        files_->saved(file, text);
    (void)channel.send(saved ? core::file_saved_message(file)
                             : core::file_error_message(file, saved.error()));
}

void SimulationPrograms::wish(core::CompileMessage const& message, Channel& channel)
{
    auto allowed = files_ ? files_->may_compile(message.controller, context_.clock.now())
                          : core::refused(core::Refused::not_editable);
    if (allowed && !simulation_)
        allowed = core::refused(core::Refused::still_fetching);
    if (allowed && !can_compile())
        allowed = core::refused(core::Refused::no_compiler, {{"controller", message.controller}});
    if (allowed && !wish_.empty())
        allowed = core::refused(core::Refused::saved_too_often);
    if (!allowed) {
        (void)channel.send(core::compiled_message(message.controller, {}, allowed));
        return;
    }
    wish_ = message.controller;
    wished_.notify();
}

asio::awaitable<void> SimulationPrograms::compile_wishes(Channel& channel)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            break;
        if (wish_.empty())
            (void)co_await wished_.wait();
        else
            co_await compile(channel);
    }
    wish_.clear();
}

/// Precondition: there is a wish, and so a simulation.
asio::awaitable<void> SimulationPrograms::compile(Channel& channel)
{
    ControllerSources sources(wish_, project_->root / folder_name / wish_, files_->has_makefile(wish_));
    auto const compiled = co_await simulation_->compile(std::move(sources));
    (void)channel.send(core::compiled_message(wish_, compiled.output, compiled.outcome));
    wish_.clear();
}

asio::awaitable<result<>> SimulationPrograms::restore(std::string file)
{
    auto const name = concat(folder_name, "/", file);
    auto restored = co_await context_.fetcher.restore(*project_, name);
    if (restored && simulation_) {
        auto path = project_->root / name;
        restored = co_await simulation_->put_back(std::move(path));
    }
    if (restored && files_)
        files_->restored(file);
    co_return restored;
}

} // namespace webots_cloud
