!! Several motions by the exact propagator, side by side where they are in like modes.
!!
!! Each motion goes its own way through its modes, with its own time and events. Those that wait at the same gate
!! (razy_exact_lanes_gates) are followed together to the ends of their next pieces (razy_exact_lanes_kernel), up to as many as
!! there are lanes; a motion that has come to its end leaves its lane to the next. What lanes do not decide, and modes that
!! are new to a motion, are for the propagator of one motion, piece by piece, until the motion is at a gate again. So a motion does
!! not depend on the others, bit for bit.
module razy_exact_lanes_together
   use razy_core_kinds, only: i8, wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, reserve
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_exact, only: cross, exact_t, place_piece
   use razy_exact_lanes_block, only: block_t, lanes, make_room
   use razy_exact_lanes_gates, only: fits_lanes, is_of_mode, lane_mode_t, list_amplitudes, new_gate, new_lane_mode, &
                                     numbers_of_gate, numbers_of_mode, take_amplitudes
   use razy_exact_lanes_width, only: follow_at_width, widest
   use razy_hybrid_flow, only: conclude, course_t, go_on, is_under_way, set_out
   use razy_machine_machine, only: same_structure
   use razy_motion_integrator, only: observer_slot_t, show_piece, status_ok
   implicit none(type, external)
   private

   public :: follow_together, motion_t

   !> A motion that is prepared, until when, s, and with how many events at most it is followed, who sees it, and its course.
   type :: motion_t
      type(exact_t), pointer :: by => null()
      real(wp) :: t_end = 0.0_wp
      integer(i8) :: most_events = 0
      type(observer_slot_t), allocatable :: observers(:)
      type(course_t) :: course
   end type motion_t

   !> A motion's own numbers through a gate, and the solution that follows; 0: it does not know it yet.
   type :: own_gate_t
      integer :: to = 0
      real(wp), allocatable :: numbers(:)
   end type own_gate_t

   !> A motion's own numbers in the mode of one of its solutions, and the mode's number; 0: not known yet, -1: not for lanes.
   type :: own_mode_t
      integer :: mode = 0
      real(wp), allocatable :: numbers(:)
      type(own_gate_t), allocatable :: gate(:)
   end type own_mode_t

   !> A motion on its way.
   type :: runner_t
      !> The registry of its structure; the solution of its last piece and the guard that was left, with the gate's number, 0: it is
      !> followed alone.
      integer :: registry = 0, at = 0, guard = 0, gate = 0
      logical :: ended = .false.
      !> Pieces that it was taken into lanes for, and that these did not decide.
      integer(i8) :: tried = 0, undecided = 0
      !> When the first observer begins to look, s.
      real(wp) :: begins = 0.0_wp
      !> By solutions.
      type(own_mode_t), allocatable :: own(:)
      !> At the gate: time, s (sum of both), amplitudes, cosines and sines of the tones; frequencies of these.
      real(wp) :: time = 0.0_wp, time_low = 0.0_wp
      real(wp), allocatable :: state(:), cosine(:), sine(:), tone(:)
      !> Workspace: lists of a motion at the start and the end of a piece.
      type(amplitudes_t) :: first, last
   end type runner_t

   !> Modes of all motions of the same structure.
   type :: registry_t
      integer :: modes = 0, gates = 0
      type(lane_mode_t), allocatable :: mode(:)
   end type registry_t

   !> A motion of which lanes do not decide more than a few pieces, and one of so many, is followed alone from then on.
   integer(i8), parameter :: few = 8, most_undecided = 8
   !> A time that is nearer to the end of a motion is for its last piece.
   real(wp), parameter :: last_part = 8*epsilon(1.0_wp)

contains

   !> Run all motions to their ends, by instructions of a `level` of x86-64, else the widest that there are
   !> (razy_exact_lanes_width).
   subroutine follow_together(motion, level)
      type(motion_t), intent(inout), target :: motion(:)
      integer, intent(in), optional :: level

      type(runner_t) :: runner(size(motion))
      type(registry_t) :: registry(size(motion))
      type(block_t) :: block
      integer :: i, width
      logical :: waiting

      width = widest()
      if (present(level)) width = min(level, width)
      do i = 1, size(motion)
         call begin(motion(i), runner(i))
         call find_registry(motion, i, runner, registry)
      end do
      do
         waiting = .false.
         do i = 1, size(motion)
            if (runner(i)%ended) cycle
            if (runner(i)%gate == 0) call follow_alone(motion(i), runner(i), registry(runner(i)%registry))
            waiting = waiting .or. runner(i)%gate > 0
         end do
         if (.not. waiting) exit
         call follow_next(motion, runner, registry, width, block)
      end do
   end subroutine follow_together

   subroutine begin(motion, runner)
      type(motion_t), intent(inout) :: motion
      type(runner_t), intent(inout) :: runner

      integer :: i

      call set_out(motion%by, motion%t_end, motion%most_events, motion%observers, motion%course)
      runner%begins = motion%t_end
      do i = 1, size(motion%observers)
         runner%begins = min(runner%begins, motion%observers(i)%observer%begins())
      end do
      associate (tone => motion%by%system%machine%tone)
         allocate (runner%cosine(size(tone)), runner%sine(size(tone)), runner%own(0))
         runner%tone = [tone%omega, (tone(i)%hertz, tone(i)%hertz_low, tone(i)%upper, tone(i)%lower, i=1, size(tone))]
      end associate
   end subroutine begin

   !> The registry of the first motion with the same structure, and tones that allow stretches as long.
   subroutine find_registry(motion, i, runner, registry)
      type(motion_t), intent(in) :: motion(:)
      integer, intent(in) :: i
      type(runner_t), intent(inout) :: runner(:)
      type(registry_t), intent(inout) :: registry(:)

      integer :: j

      associate (mine => motion(i)%by%system)
         do j = 1, i - 1
            associate (other => motion(j)%by%system)
               if (same_structure(other%machine, mine%machine) .and. (other%keep_all .eqv. mine%keep_all) &
                   .and. size(other%omega) == size(mine%omega) .and. exponent(other%fastest) == exponent(mine%fastest)) exit
            end associate
         end do
      end associate
      runner(i)%registry = j
      if (j < i) runner(i)%registry = runner(j)%registry
      if (j == i) allocate (registry(i)%mode(4))
   end subroutine find_registry

   !> Follow a motion piece by piece until it is at a gate, or at its end.
   subroutine follow_alone(motion, runner, registry)
      type(motion_t), intent(inout) :: motion
      type(runner_t), intent(inout) :: runner
      type(registry_t), intent(inout) :: registry

      do
         if (.not. is_under_way(motion%by, motion%course)) then
            runner%ended = .true.
            call conclude(motion%by, motion%course)
            return
         end if
         call go_on(motion%by, motion%observers, motion%course)
         if (motion%course%outcome%status == status_ok) call come_to_gate(motion%by, runner, registry)
         if (runner%gate > 0) return
      end do
   end subroutine follow_alone

   !> Where a motion has come to at the end of a piece that it was followed alone: a gate, if it may go on in lanes.
   subroutine come_to_gate(by, runner, registry)
      type(exact_t), intent(inout) :: by
      type(runner_t), intent(inout) :: runner
      type(registry_t), intent(inout) :: registry

      if (runner%undecided > few .and. most_undecided*runner%undecided > runner%tried) return
      if (by%left == 0 .or. by%switching%acts .or. allocated(by%tangent)) return
      if (by%system%constrained .or. any(by%system%machine%tone%is_swept())) return
      runner%at = by%now
      runner%guard = by%left
      call find_gate(by, runner, registry)
      if (runner%gate == 0) return
      runner%state = take_amplitudes(by%solutions%of(by%now)%response, by%search%probe%x)
      runner%time = by%time
      runner%time_low = by%time_low
      associate (excitation => by%transition%dynamics%excitation)
         call excitation%begin(by%system%machine%tone, by%time, by%time_low)
         runner%cosine(:) = real(excitation%start)
         runner%sine(:) = aimag(excitation%start)
      end associate
   end subroutine come_to_gate

   !> The gate through which a runner has to go; none if what follows is not known yet, or not for lanes.
   subroutine find_gate(by, runner, registry)
      type(exact_t), intent(in) :: by
      type(runner_t), intent(inout) :: runner
      type(registry_t), intent(inout) :: registry

      type(own_mode_t), allocatable :: more(:)
      integer :: branch(size(by%branch)), from, next, to

      runner%gate = 0
      if (size(runner%own) < by%solutions%count) then
         allocate (more(by%solutions%count))
         more(:size(runner%own)) = runner%own
         call move_alloc(more, runner%own)
      end if
      call find_mode(by, runner, registry, runner%at, from)
      if (from <= 0) return
      associate (own => runner%own(runner%at)%gate(runner%guard), solution => by%solutions%of(runner%at))
         if (own%to == 0) then
            branch = solution%branch
            branch(solution%entry(runner%guard)%contact) = solution%entry(runner%guard)%next
            next = by%solutions%known(by%system, branch)
            if (next == 0) return
            call find_mode(by, runner, registry, next, to)
            if (to <= 0) return
            own%to = next
            own%numbers = numbers_of_gate(solution%response, by%solutions%of(next)%response)
            associate (gate => registry%mode(from)%gate(runner%guard))
               if (gate%number == 0) then
                  registry%gates = registry%gates + 1
                  call new_gate(gate, registry%gates, solution, runner%guard, to, by%solutions%of(next))
               end if
            end associate
         end if
      end associate
      associate (gate => registry%mode(from)%gate(runner%guard))
         runner%gate = gate%number
         gate%waiting = gate%waiting + 1
      end associate
   end subroutine find_gate

   !> The mode of solution i in the registry, and the runner's own numbers in it.
   subroutine find_mode(by, runner, registry, i, mode)
      type(exact_t), intent(in) :: by
      type(runner_t), intent(inout) :: runner
      type(registry_t), intent(inout) :: registry
      integer, intent(in) :: i
      integer, intent(out) :: mode

      type(lane_mode_t), allocatable :: larger(:)

      mode = runner%own(i)%mode
      if (mode /= 0) return
      mode = -1
      associate (own => runner%own(i), solution => by%solutions%of(i))
         if (fits_lanes(solution)) then
            do mode = 1, registry%modes
               if (is_of_mode(solution, registry%mode(mode))) exit
            end do
            if (mode > size(registry%mode)) then
               allocate (larger(2*size(registry%mode)))
               larger(:registry%modes) = registry%mode
               call move_alloc(larger, registry%mode)
            end if
            if (mode > registry%modes) call new_lane_mode(registry%mode(mode), solution)
            registry%modes = max(registry%modes, mode)
            own%numbers = numbers_of_mode(registry%mode(mode), solution)
            allocate (own%gate(size(solution%watched)))
         end if
         own%mode = mode
      end associate
   end subroutine find_mode

   !> Follow the motions at the gate where most are waiting, as many as there are lanes.
   subroutine follow_next(motion, runner, registry, width, block)
      type(motion_t), intent(inout), target :: motion(:)
      type(runner_t), intent(inout) :: runner(:)
      type(registry_t), intent(inout) :: registry(:)
      integer, intent(in) :: width
      type(block_t), intent(inout) :: block

      integer :: i, l, most, n, taken(lanes)

      most = 0
      n = 0
      do i = 1, size(runner)
         if (runner(i)%gate == 0) cycle
         l = waiting_with(runner(i), registry(runner(i)%registry))
         if (l > most) n = i
         most = max(most, l)
      end do
      taken(1) = n
      n = 1
      do i = taken(1) + 1, size(runner)
         if (n == lanes) exit
         if (runner(i)%gate /= runner(taken(1))%gate .or. runner(i)%registry /= runner(taken(1))%registry) cycle
         n = n + 1
         taken(n) = i
      end do
      associate (first => runner(taken(1)), modes => registry(runner(taken(1))%registry)%mode)
         associate (gate => modes(first%own(first%at)%mode)%gate(first%guard))
            associate (mode => modes(gate%to))
               call make_room(block, max(mode%rows, gate%before), mode%tones, mode%numbers, mode%rows*(2*mode%tones + 1))
               do l = 1, lanes
                  ! Lanes that nobody needs go with the first.
                  i = taken(merge(l, 1, l <= n))
                  call enter_lane(block, l, runner(i), motion(i)%t_end)
               end do
               gate%waiting = gate%waiting - n
               call follow_at_width(width, mode, gate, block)
            end associate
         end associate
      end associate
      do l = 1, n
         associate (one => motion(taken(l)), its => runner(taken(l)))
            its%tried = its%tried + 1
            if (block%left(l) > 0.5_wp) then
               call leave_lane(block, l, one, its, registry(its%registry))
            else
               its%gate = 0
               its%undecided = its%undecided + 1
               call give_back(one%by, its)
            end if
         end associate
      end do
   end subroutine follow_next

   !> How many motions wait at the gate of a runner.
   pure integer function waiting_with(runner, registry)
      type(runner_t), intent(in) :: runner
      type(registry_t), intent(in) :: registry

      waiting_with = registry%mode(runner%own(runner%at)%mode)%gate(runner%guard)%waiting
   end function waiting_with

   pure subroutine enter_lane(block, l, runner, t_end)
      type(block_t), intent(inout) :: block
      integer, intent(in) :: l
      type(runner_t), intent(in) :: runner
      real(wp), intent(in) :: t_end

      integer :: i

      associate (gate => runner%own(runner%at)%gate(runner%guard))
         do i = 1, size(runner%state)
            block%state(l, i) = runner%state(i)
         end do
         do i = 1, size(gate%numbers)
            block%through(l, i) = gate%numbers(i)
         end do
         associate (own => runner%own(gate%to)%numbers)
            do i = 1, size(own)
               block%own(l, i) = own(i)
            end do
         end associate
      end associate
      do i = 1, size(runner%cosine)
         block%cosine(l, i) = runner%cosine(i)
         block%sine(l, i) = runner%sine(i)
      end do
      do i = 1, size(runner%tone)
         block%tone(l, i) = runner%tone(i)
      end do
      block%time(l) = runner%time
      block%time_low(l) = runner%time_low
      block%rest(l) = (1 - last_part)*((t_end - runner%time) - runner%time_low)
   end subroutine enter_lane

   !> Take a motion through its piece to the end of it, show it, and see which gate comes next.
   subroutine leave_lane(block, l, motion, runner, registry)
      type(block_t), intent(in) :: block
      integer, intent(in) :: l
      type(motion_t), intent(inout) :: motion
      type(runner_t), intent(inout) :: runner
      type(registry_t), intent(inout) :: registry

      integer :: i
      logical :: more

      associate (by => motion%by, course => motion%course)
         runner%at = runner%own(runner%at)%gate(runner%guard)%to
         runner%guard = int(block%left(l) + 0.5_wp)
         associate (solution => by%solutions%of(runner%at), piece => course%piece)
            if (size(runner%state) /= solution%response%rows) then
               deallocate (runner%state)
               allocate (runner%state(solution%response%rows))
            end if
            if (block%time(l) >= runner%begins) then
               runner%state(:) = block%start(l, :size(runner%state))
               call list(solution%response, runner, runner%first)
            end if
            piece%time = runner%time
            piece%time_low = runner%time_low
            do i = 1, size(runner%state)
               runner%state(i) = block%state(l, i)
            end do
            do i = 1, size(runner%cosine)
               runner%cosine(i) = block%cosine(l, i)
               runner%sine(i) = block%sine(l, i)
            end do
            runner%time = block%time(l)
            runner%time_low = block%time_low(l)
            course%outcome%events = course%outcome%events + 1
            course%outcome%pieces = course%outcome%pieces + 1
            by%search%steps = by%search%steps + int(block%stretches(l), i8)
            if (block%time(l) >= runner%begins) then
               call list(solution%response, runner, runner%last)
               runner%last%tau = block%tau(l)
               call place_piece(by, runner%at, runner%first, runner%last, block%tau(l))
               by%branch(:) = solution%branch
               piece%duration = block%tau(l)
               piece%last = .false.
               piece%contact = solution%entry(runner%guard)%contact
               piece%branch = solution%entry(runner%guard)%next
               call show_piece(motion%observers, piece)
            end if
         end associate
         call by%budget%spend()
         if (by%budget%status /= status_ok) course%outcome%status = by%budget%status
         more = course%outcome%status == status_ok
         if (more) more = course%may_go_on(runner%time)
         runner%gate = 0
         if (more) call find_gate(by, runner, registry)
         if (runner%gate == 0) call give_back(by, runner)
      end associate
   end subroutine leave_lane

   !> Amplitudes and tones of a runner as the list of a motion.
   subroutine list(response, runner, x)
      type(response_t), intent(in) :: response
      type(runner_t), intent(in) :: runner
      type(amplitudes_t), intent(inout) :: x

      call reserve(x, response)
      call list_amplitudes(response, runner%state, runner%cosine, runner%sine, x%x)
   end subroutine list

   !> A motion is followed alone from the end of its last piece on.
   subroutine give_back(by, runner)
      type(exact_t), intent(inout) :: by
      type(runner_t), intent(inout) :: runner

      call list(by%solutions%of(runner%at)%response, runner, runner%last)
      call place_piece(by, runner%at, runner%last, runner%last, 0.0_wp)
      call cross(by, runner%guard)
      by%time = runner%time
      by%time_low = runner%time_low
   end subroutine give_back

end module razy_exact_lanes_together
