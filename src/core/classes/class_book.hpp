// All classes of a session server: who teaches, who learns, and what each is told. In memory only.
#pragma once

#include "class_limits.hpp"
#include "class_messages.hpp"
#include "class_pictures.hpp"
#include "class_simulators.hpp"
#include "class_text.hpp"
#include "core/access/password_guesses.hpp"
#include "core/access/silent_clients.hpp"
#include "core/access/token_buckets.hpp"
#include "core/pace.hpp"
#include "core/simulation/staging_messages.hpp"

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// A connection of a browser; later ones have higher numbers.
using ClassConnection = std::uint64_t;

/// Something to do with a connection.
struct ClassOutput
{
    ClassConnection to = 0;
    std::string text;             ///< To be sent; empty: nothing.
    bool is_picture = false;      ///< May be left out where the browser does not keep up.
    std::uint16_t close_code = 0; ///< After that; 0: it stays open.
};

/// What a ClassBook asks of the server around it.
struct ClassHooks
{
    ClassHooks() = default;

    RandomBytes random;
    /// How many seats are free on the machines, those held for classes included.
    std::function<std::size_t()> free_seats;
    /// Where the project of a class can be fetched beforehand, as this browser reaches the machines.
    std::function<std::vector<std::string>(ClassConnection teacher)> machines;
    /// Where students reach the page, if this browser's address of it leads to this machine alone. Empty:
    /// nobody knows.
    std::function<ClassNetwork(ClassConnection teacher)> network;
    /// Where this browser reaches a simulator, whose entry is as `simulator_entry` makes it:
    /// `ws://host:2001`.
    std::function<std::string(std::string_view entry, ClassConnection teacher)> simulator_address;
    /// Somebody tries passwords or codes (`what`), and is refused from now on.
    std::function<void(std::string_view what, std::string_view quota_key)> tell_of_guesses;
};

/// What a student who asks for a simulation gets.
enum class SeatRequest
{
    unknown,  ///< There is no such student.
    held,     ///< A seat that is held for the class.
    any,      ///< The class has used all its seats: one like everybody's.
    too_often ///< Nothing now.
};

struct ClassFigures
{
    ClassFigures() = default;

    std::size_t classes = 0;
    std::size_t students = 0;
    std::size_t seats_held = 0;
};

/// Decides what becomes of the messages of WebSocket /class. What is to be sent is collected: call
/// `take_output` after each other function.
class ClassBook
{
public:
    explicit ClassBook(ClassHooks hooks);
    ~ClassBook();

    /// Empty: nobody can open a class. Those that exist go on.
    void set_password(std::string password) { password_ = std::move(password); }

    void connect(ClassConnection connection, std::string quota_key);
    void take(ClassConnection connection, std::string_view text, TimePoint now);
    /// The connection has ended, whoever ended it.
    void disconnect(ClassConnection connection, TimePoint now);
    /// To be called about once a second: what has been away for too long is forgotten, and free seats are
    /// shared anew.
    void expire(TimePoint now);
    /// The server is being stopped: everybody is told.
    void stop();

    std::vector<ClassOutput> take_output() { return std::exchange(output_, {}); }

    /// A student, who is known by a token for that alone, asks for a simulation. A seat that the student has
    /// already is free again, as a page asks anew only where its simulation is over.
    SeatRequest ask_for_seat(std::string_view seat_token, TimePoint now);
    /// What the students of one class have in common, and others have not; empty: there is no such student.
    std::string class_of(std::string_view seat_token) const;
    /// The student has been sent to a machine.
    void take_seat(std::string_view seat_token, SeatRequest seat, StudentMachine machine, TimePoint now);
    /// How many seats to hold back from others: of each class, those that no student has taken yet.
    std::size_t seats_to_hold() const noexcept;

    /// Of each class: its world, and the seats that no student has taken yet.
    std::vector<StagingWish> staging_wishes() const;
    /// How many simulations are ready for each of them. Empty: no machine has any ready for classes.
    void note_ready(std::vector<int> const& ready);

    ClassFigures figures() const noexcept;

private:
    struct Student;
    struct Class;
    struct Connection
    {
        std::string quota_key;
        Class* of = nullptr;   ///< Null: in no class yet.
        StudentId student = 0; ///< 0: a teacher.
        bool closing = false;  ///< By us: what it still says is ignored.
        Pace messages;
    };

    void obey(ClassConnection from, BadClassMessage const& message, TimePoint now);
    void obey(ClassConnection from, OpenClass const& message, TimePoint now);
    void obey(ClassConnection from, ReturnAsTeacher const& message, TimePoint now);
    void obey(ClassConnection from, SetSeats const& message, TimePoint now);
    void obey(ClassConnection from, ChangeWorld const& message, TimePoint now);
    void obey(ClassConnection from, WatchPictures const& message, TimePoint now);
    void obey(ClassConnection from, TellStudents const& message, TimePoint now);
    void obey(ClassConnection from, RenewCode const& message, TimePoint now);
    void obey(ClassConnection from, CloseClass const& message, TimePoint now);
    void obey(ClassConnection from, CheckCode const& message, TimePoint now);
    void obey(ClassConnection from, JoinClass const& message, TimePoint now);
    void obey(ClassConnection from, ReturnAsStudent const& message, TimePoint now);
    void obey(ClassConnection from, ReportState const& message, TimePoint now);
    void obey(ClassConnection from, ShowSign const& message, TimePoint now);
    void obey(ClassConnection from, ReportPicture const& message, TimePoint now);
    void obey(ClassConnection from, ReportProgram const& message, TimePoint now);
    void obey(ClassConnection from, LeaveClass const& message, TimePoint now);

    Class* class_of_teacher(ClassConnection from);
    Class* class_to_join(ClassConnection from, std::string_view code, TimePoint now);
    std::pair<Class*, Student*> class_of_student(ClassConnection from);
    using Tokens = std::unordered_map<std::string, std::pair<Class*, StudentId>>;
    static std::pair<Class*, Student*> find_student(Tokens const& tokens, std::string_view token);
    std::string unused_code() const;
    bool may_try(GuessLimit const& limit, ClassConnection from, std::string_view what, TimePoint now);
    void add_teacher(Class& of, ClassConnection teacher);
    void greet_student(Class& of, Student& student, ClassConnection connection);
    void forget_student(Class& of, StudentId id);
    void forget_tokens(Student const& student);
    void end_class(Class& of, ClassEnd why);
    void share_free_seats();
    void update_pictures(Class& of);
    void lower(Class& of, Student& student);
    void release_seat(Class& of, Student& student);
    void tell_teachers(Class const& of, std::string const& text);
    void tell_teachers(Class const& of, Student const& student);
    std::string simulator_for(ClassConnection teacher, std::string_view entry);
    void say(ClassConnection to, std::string text);
    void refuse(ClassConnection to, ClassError error) { say(to, class_error_message(error)); }
    void close(ClassConnection connection, std::string text, std::uint16_t code);

    ClassHooks hooks_;
    std::string password_;
    std::vector<std::unique_ptr<Class>> classes_; // the oldest first
    std::unordered_map<ClassConnection, Connection> connections_;
    Tokens tokens_; // of the students of all classes
    Tokens seat_tokens_;
    SilentClients silent_{class_limits::silent, class_limits::silent_per_client};
    GuessLimit passwords_{passwords_of_client, passwords_of_all};
    GuessLimit codes_{class_limits::codes_of_client, class_limits::codes_of_all};
    TokenBuckets joins_{class_limits::joins_burst, class_limits::joins_a_second};
    std::vector<ClassOutput> output_;
};

} // namespace webots_cloud::core
