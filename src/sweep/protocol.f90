!! What rank 0 and the other ranks of a sweep say to each other, and how much work is handed out at a time.
!!
!! To rank 0: a request for the next chunk (two words: 1 if this rank was asked to stop; time of a unit in its last chunk, s);
!! rows of points (razy_sweep_packet); when all is done, a tally.
!! From rank 0: a chunk, that is first unit and number of units (razy_sweep_units), where no units means that none are left; once,
!! the word that it is over (no contents): in answer to the tally, or before, and then chunks that have come or come later are not
!! computed.
module razy_sweep_protocol
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: ask_interrupt, chunk_size, pack_tally, sweep_options_t, tally_t, unpack_tally

   integer, parameter, public :: tag_request = 1, tag_results = 2, tag_tally = 3, tag_chunk = 4, tag_stop = 5

   !> A chunk is what remains divided by this and the number of ranks.
   integer, parameter :: shares_per_rank = 8

   !> How the work is distributed. Nothing of it changes a result.
   type :: sweep_options_t
      !> Rank 0 computes points, too, in sweeps of up to this many ranks; with more it only manages, so that nobody waits for it.
      integer :: largest_working_manager = 32
      !> A chunk is a share of what remains, at least and at most so many points.
      integer(i8) :: smallest_chunk = 1, largest_chunk = 1024
      !> Time that rank 0 has for a request while all others are busy with their chunks, on the average [s]: what taking it
      !> and answering costs by TCP.
      real(wp) :: request_time = 10.0e-6_wp
      !> Ask for the next chunk before the present one is computed: not for points that are few and long.
      logical :: ask_ahead = .true.
      !> Results are sent when they fill so many 64-bit words or when the last were sent so long ago [s].
      integer(i8) :: packet_words = 4096
      real(wp) :: send_interval = 0.1_wp
      !> Time after which rank 0 settles what it computed itself, and, if it only manages, what it received [s].
      real(wp) :: settle_interval = 0.02_wp
      !> Least time between two calls of `progress` [s].
      real(wp) :: progress_interval = 0.1_wp
   end type sweep_options_t

   !> What a rank did.
   type :: tally_t
      !> Rows computed, messages sent.
      integer(i8) :: points = 0, messages = 0
      !> Time spent in computing points [s].
      real(wp) :: busy = 0.0_wp
   end type tally_t

   abstract interface
      !> Whether the program was asked to stop.
      logical function ask_interrupt()
         implicit none(type, external)
      end function ask_interrupt
   end interface

contains

   !> Number of points to hand out when `remaining` are left: many at first, one at the end, so that points of unequal cost balance.
   !> `unit_time` is what a unit took the rank that asks [s], 0 if it does not know: with many ranks short units are handed out
   !> several at a time, so that rank 0 can serve all, as long as two such chunks a rank remain.
   elemental integer(i8) function chunk_size(remaining, ranks, unit_time, options)
      integer(i8), intent(in) :: remaining
      integer, intent(in) :: ranks
      real(wp), intent(in) :: unit_time
      type(sweep_options_t), intent(in) :: options
      integer(i8) :: share, half

      share = remaining/(int(shares_per_rank, i8)*ranks)
      half = remaining/(2_i8*ranks)
      if (unit_time > 0.0_wp) share = max(share, int(min(real(half, wp), ranks*options%request_time/unit_time), i8))
      chunk_size = min(remaining, max(options%smallest_chunk, 1_i8, min(options%largest_chunk, share)))
   end function chunk_size

   !> A tally as words (3) of a message.
   pure function pack_tally(tally) result(words)
      type(tally_t), intent(in) :: tally
      integer(i8) :: words(3)

      words = [tally%points, tally%messages, transfer(tally%busy, 0_i8)]
   end function pack_tally

   !> The tally in words (3) of a message.
   pure type(tally_t) function unpack_tally(words)
      integer(i8), intent(in) :: words(:)

      unpack_tally = tally_t(points=words(1), messages=words(2), busy=transfer(words(3), 0.0_wp))
   end function unpack_tally

end module razy_sweep_protocol
