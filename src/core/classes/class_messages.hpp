// The messages of the WebSocket /class (protocol section 13.15), in and out: JSON objects with one key.
#pragma once

#include "class_pictures.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace webots_cloud::core {

/// Why something is refused. The page says its own text for each.
enum class ClassError
{
    off, ///< No password is configured: there are no classes.
    password,
    tries, ///< Too many wrong passwords or codes.
    code,  ///< There is no such class, or not any more.
    full,  ///< The class has as many students as it may have.
    name,
    limit, ///< Too many classes, or windows of one.
    seats,
    world,
    message ///< Not understood.
};

enum class StudentState
{
    joined,
    starting,
    running,
    paused,
    waiting, ///< For a free machine.
    hidden,  ///< The page is: nobody looks.
    lost,    ///< The page has lost the simulation.
    ended,
    away ///< The connection is lost. Said by the server alone.
};

/// What a student shows the teacher.
enum class StudentSign
{
    none,
    hand, ///< Help is wanted.
    done  ///< The task is.
};

/// What a teacher has students' pages do.
enum class ClassAction
{
    pause,
    run,
    reset,
    end,
    start, ///< Those whose simulation is over start again.
    lower, ///< Take the student's sign away.
    message,
    program, ///< Show the teacher the program that is in the editor.
    take,    ///< Put a program of the teacher's into the editor.
    remove
};

using StudentId = std::int64_t;

// --- from teachers

struct OpenClass
{
    std::string password;
    std::string world;
    std::string mode;
    std::size_t seats = 0;
};

/// A teacher's page was reloaded, or another window is opened.
struct ReturnAsTeacher
{
    std::string key;
};

struct SetSeats
{
    std::size_t seats = 0;
};

/// Everybody leaves the old one, and starts this one.
struct ChangeWorld
{
    std::string world;
    std::string mode;
};

struct WatchPictures
{
    bool on = false;
};

struct TellStudents
{
    std::optional<std::vector<StudentId>> students; ///< None: all.
    ClassAction action = ClassAction::pause;
    std::string text; ///< Of `message` and `take`.
    std::string file; ///< Of `take`: below the folder of the controllers.
};

/// The old code no longer lets anybody in.
struct RenewCode
{};

struct CloseClass
{};

// --- from students

/// Whether a code is one, before anybody is asked for a name.
struct CheckCode
{
    std::string code; ///< As `read_class_code` returns it.
};

struct JoinClass
{
    std::string code; ///< As `read_class_code` returns it.
    std::string name;
};

/// A student's connection was lost, or the page reloaded.
struct ReturnAsStudent
{
    std::string token;
};

/// The program that a student's simulation runs, as its page says.
struct StudentProgram
{
    StudentProgram() = default;

    std::string file;                 ///< Below the folder of the controllers.
    bool is_changed = false;          ///< It is not as the project, or the teacher, has handed it out.
    std::int64_t wrong_line = 0;      ///< That Python or a compiler complains of; 0: of none.
    std::optional<std::int64_t> goal; ///< Reached, after so many milliseconds of simulated time.
};

struct ReportState
{
    StudentState state = StudentState::joined;
    std::int64_t time = 0; ///< Milliseconds of simulated time.
    std::string simulator; ///< As the page says; empty: there is none.
    std::string why;       ///< What it waits for, or why it has ended: a word of the pages, or a line.
    std::optional<std::int64_t> ahead; ///< So many are before it in the line.
    std::optional<StudentProgram> program;
};

struct ShowSign
{
    StudentSign sign = StudentSign::none;
};

struct ReportPicture
{
    std::string base64; ///< Unchecked.
};

/// What a teacher has asked for.
struct ReportProgram
{
    std::string file;
    std::string text;
};

struct LeaveClass
{};

// --- from anybody

struct BadClassMessage
{
    ClassError error = ClassError::message;
};

using ClassMessage =
    std::variant<BadClassMessage, OpenClass, ReturnAsTeacher, SetSeats, ChangeWorld, WatchPictures,
                 TellStudents, RenewCode, CloseClass, CheckCode, JoinClass, ReturnAsStudent, ReportState,
                 ShowSign, ReportPicture, ReportProgram, LeaveClass>;

/// Reads any bytes.
ClassMessage parse_class_message(std::string_view text);

// --- to both

/// `{"error":CODE,"text":...}`
std::string class_error_message(ClassError error);

enum class ClassEnd
{
    teacher, ///< The teacher has ended it.
    idle,    ///< No teacher was there for too long.
    removed, ///< The teacher has removed this student.
    server   ///< The server is being stopped.
};

/// `{"closed":"teacher"}`
std::string class_closed_message(ClassEnd end);

// --- to teachers

struct StudentRow
{
    StudentId id = 0;
    std::string_view name;
    StudentState state = StudentState::joined;
    std::int64_t time = 0;
    std::string_view simulator;
    StudentSign sign = StudentSign::none;
    std::string_view why;
    std::optional<std::int64_t> ahead;
    StudentProgram const* program = nullptr; ///< Null: nothing is known of one.
};

/// Where other machines find this one.
struct ClassNetwork
{
    ClassNetwork() = default;

    std::vector<std::string> addresses; ///< `192.168.1.5`
    bool is_open = false;               ///< The site answers there; else it is for this machine alone.
};

/// Of the seats that no student has used yet: so many have a simulation that is ready.
struct StagedSeats
{
    std::size_t ready = 0;
    std::size_t seats = 0;

    bool operator==(StagedSeats const&) const = default;
};

struct ClassRow
{
    std::string_view code;
    std::string_view key;
    std::string_view world;
    std::string_view mode;
    std::size_t seats = 0;
    std::size_t reserved = 0;
    std::optional<StagedSeats> staged; ///< None: no machine has any ready.
    std::vector<StudentRow> students;
    std::vector<std::string> machines;
    ClassNetwork network;
};

/// `{"class":{...}}`
std::string class_message(ClassRow const& row);

/// `{"student":{...}}`
std::string student_message(StudentRow const& student);

/// `{"gone":1}`
std::string gone_message(StudentId student);

/// `{"picture":{"id":1,"jpeg":...}}`
std::string picture_message(StudentId student, std::string_view base64);

/// `{"program":{"id":1,"file":...,"text":...}}`
std::string program_message(StudentId student, std::string_view file, std::string_view text);

/// `{"reserved":18}`
std::string reserved_message(std::size_t seats);

/// `{"staged":{"ready":12,"seats":30}}`, `{"staged":null}`
std::string staged_seats_message(std::optional<StagedSeats> const& staged);

/// `{"code":"K7M2QX"}`
std::string code_message(std::string_view code);

/// To teachers and students: `{"world":{"world":...,"mode":...}}`
std::string world_message(std::string_view world, std::string_view mode);

// --- to students

/// `{"checked":"K7M2QX"}`
std::string checked_message(std::string_view code);

/// `{"sign":"hand"}`
std::string sign_message(StudentSign sign);

struct JoinedRow
{
    StudentId id = 0;
    std::string_view token; ///< To return with.
    std::string_view
        seat; ///< To ask for simulations with: it stands in addresses, and so in logs of proxies.
    std::string_view name;
    std::string_view world;
    std::string_view mode;
    StudentSign sign = StudentSign::none;
};

/// `{"joined":{...}}`
std::string joined_message(JoinedRow const& row);

/// `{"pictures":{...}}`; null: none are wanted.
std::string pictures_message(PictureTerms const* terms);

/// `{"do":"pause"}`, `{"do":"message","text":...}`, `{"do":"take","file":...,"text":...}`
std::string action_message(TellStudents const& message);

} // namespace webots_cloud::core
