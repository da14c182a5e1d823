// How much classes may take: memory and work stay bounded, whatever clients send.
#pragma once

#include <webots_cloud/guess_limit.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>

namespace webots_cloud::core::class_limits {

inline constexpr std::size_t classes = 20;          ///< At once.
inline constexpr std::size_t seats = 100;           ///< Of one class.
inline constexpr std::size_t students_per_seat = 2; ///< Some leave and come back under another name.
inline constexpr std::size_t windows = 8;           ///< Of the teacher of one class.
inline constexpr std::size_t name = 40;             ///< Characters of a student's name.
inline constexpr std::size_t text = 200;            ///< Characters of a message, or of a reason to wait.
inline constexpr std::int64_t line = 100'000;       ///< Of a program.
inline constexpr std::int64_t ahead = 100'000;      ///< That a page may count before it in the line.
inline constexpr std::size_t world = 2048;          ///< Bytes of the address of a world.
inline constexpr std::size_t simulator = 300;       ///< Bytes of the address of a simulator.
inline constexpr std::size_t message = 64 * 1024;   ///< Bytes of a message of a client: with a program.
inline constexpr std::size_t machines = 64;         ///< That a teacher's page is told of.
inline constexpr std::size_t addresses = 8;         ///< Of this machine in its networks, likewise.

/// Connections that are in no class yet: of all clients, and of one address, behind which a school may be.
inline constexpr std::size_t silent = 500;
inline constexpr std::size_t silent_per_client = 300;

inline constexpr Duration keep_student = std::chrono::seconds(60); ///< Whose connection is lost.
inline constexpr Duration keep_class = std::chrono::minutes(60);   ///< Whose teacher is away.
inline constexpr Duration state_interval = std::chrono::milliseconds(500);
inline constexpr Duration sign_interval = std::chrono::seconds(1); ///< Of a student, on average.
inline constexpr int sign_burst = 5;
inline constexpr Duration message_interval =
    std::chrono::milliseconds(50); ///< Of one connection, on average.
inline constexpr int message_burst = 100;
inline constexpr Duration seat_interval = std::chrono::seconds(10); ///< Between two simulations of a student,
inline constexpr int seat_burst = 6;                                ///< but for the first ones.
/// Of those that are held for a class: whoever says that a simulation is over may still have it. Not of those
/// that a teacher has told to start.
inline constexpr Duration held_seat_interval = std::chrono::minutes(10);
inline constexpr int held_seat_burst = 2;
inline constexpr std::size_t joins_burst = 100; ///< Of one address: as many students at once,
inline constexpr double joins_a_second = 1;     ///< and in the long run.

/// A picture waits behind at most this many bytes that a teacher's browser has not taken; else it is dropped.
inline constexpr std::size_t queue_before_picture = 32 * 1024;

/// Wrong codes, of one client and of all together. A class behind one address mistypes codes more often than
/// a teacher the password, and nobody behind that address may keep the others from joining.
inline constexpr Guesses codes_of_client{500, 20};
inline constexpr Guesses codes_of_all{1000, 100};

} // namespace webots_cloud::core::class_limits
