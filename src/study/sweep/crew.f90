!! The points of a sweep, several at a time: motions by `exact` side by side (razy_exact_lanes_together), all others one by one.
!!
!! Each member is a sweep task with a machine, observers and an integrator of its own; what comes of a point does not depend on
!! those that are computed with it.
module razy_study_sweep_crew
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_exact_exact, only: exact_t
   use razy_exact_lanes_together, only: follow_together, motion_t
   use razy_machine_machine, only: machine_t, same_structure
   use razy_motion_integrator, only: outcome_t, status_interrupted, status_no_machine
   use razy_study_motion, only: prepare_motion
   use razy_study_sweep_continuation_state, only: continuation_state_t
   use razy_study_sweep_task, only: sweep_task_t
   use razy_sweep_clock, only: seconds
   use razy_sweep_task, only: point_task
   implicit none(type, external)
   private

   public :: crew_t, new_crew

   type, extends(point_task) :: crew_t
      type(sweep_task_t), allocatable, private :: member(:)
      !> Whether motions go side by side; then also one that is left alone at the end.
      logical, private :: side_by_side = .false.
   contains
      procedure :: describe
      procedure :: run
      procedure :: together
      procedure :: run_several
   end type crew_t

   !> Motions that are followed together: some more than there are lanes, so that lanes do not wait for the last.
   integer, parameter :: most = 32

contains

   !> The crew for a sweep, of one member where motions do not go side by side.
   subroutine new_crew(self, task)
      type(crew_t), intent(out) :: self
      type(sweep_task_t), intent(in) :: task

      allocate (self%member(1), source=task)
      if (task%motion%method%integrator /= "exact" .or. task%plan%has_chains() .or. task%watch%until_periodic) return
      if (.not. suits_lanes(self%member(1))) return
      self%side_by_side = .true.
      deallocate (self%member)
      allocate (self%member(int(min(int(most, i8), task%plan%points))), source=task)
   end subroutine new_crew

   !> Whether machines have one contact, and those at the ends of all axes the same matrices: only then motions are in like modes.
   !> With more contacts they are in so many modes that lanes stay empty.
   logical function suits_lanes(task) result(suits)
      type(sweep_task_t), intent(inout) :: task

      type(machine_t) :: first
      type(error_t), allocatable :: error
      integer(i8) :: n(size(task%grid%axes))
      integer :: i

      suits = .false.
      n = task%grid%axes%n
      call task%machine_at(1_i8, error)
      if (allocated(error)) return
      if (size(task%machine%contact) /= 1) return
      first = task%machine
      do i = 1, size(n)
         ! The last axis varies fastest.
         call task%machine_at(1 + (n(i) - 1)*product(n(i + 1:)), error)
         if (allocated(error)) return
         suits = same_structure(first, task%machine)
         if (.not. suits) return
      end do
   end function suits_lanes

   subroutine describe(self, row)
      class(crew_t), intent(inout) :: self
      type(table_t), intent(inout) :: row

      call self%member(1)%describe(row)
   end subroutine describe

   subroutine run(self, point, row, before)
      class(crew_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(table_t), intent(inout) :: row
      type(table_t), intent(in), optional :: before

      type(table_t) :: rows(1)
      logical :: broken(1)

      if (self%side_by_side) then
         rows(1) = row
         call self%run_several([point], rows, broken)
         row = rows(1)
      else
         call self%member(1)%run(point, row, before)
         self%broken_off = self%member(1)%broken_off
      end if
   end subroutine run

   pure integer function together(self)
      class(crew_t), intent(in) :: self

      together = size(self%member)
   end function together

   !> Compute several points; the time of each is its share.
   subroutine run_several(self, points, rows, broken)
      class(crew_t), intent(inout), target :: self
      integer(i8), intent(in) :: points(:)
      type(table_t), intent(inout) :: rows(:)
      logical, intent(out) :: broken(:)

      type(motion_t), allocatable :: motion(:)
      type(outcome_t) :: outcome
      type(error_t), allocatable :: error
      type(continuation_state_t) :: none
      real(wp) :: begun, share, work_begun, work_ended
      integer :: i, n, number(size(points))

      begun = seconds()
      call cpu_time(work_begun)
      allocate (motion(size(points)))
      n = 0
      number = 0
      do i = 1, size(points)
         call begin(self%member(i), points(i), motion(n + 1), error)
         if (allocated(error)) cycle
         n = n + 1
         number(i) = n
      end do
      call follow_together(motion(:n))
      call cpu_time(work_ended)
      share = 1.0_wp/size(points)
      call none%take_from()
      do i = 1, size(points)
         associate (one => self%member(i))
            outcome = outcome_t(status=status_no_machine)
            if (number(i) > 0) then
               outcome = motion(number(i))%course%outcome
               call one%watch%finish(one%machine, one%motion, outcome, one%integrator, error)
               if (allocated(error)) outcome = outcome_t(status=status_no_machine)
               if (allocated(error)) call one%watch%forget()
            end if
            broken(i) = outcome%status == status_interrupted
            call one%fill(rows(i), outcome, (seconds() - begun)*share, (work_ended - work_begun)*share, none)
         end associate
      end do
      self%broken_off = any(broken)
   end subroutine run_several

   !> Make the motion of a point ready.
   subroutine begin(member, point, motion, error)
      type(sweep_task_t), intent(inout), target :: member
      integer(i8), intent(in) :: point
      type(motion_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error

      call member%watch%forget()
      call member%machine_at(point, error)
      if (allocated(error)) return
      call prepare_motion(member%machine, member%motion%method, error, member%watch%needs_all(), member%integrator, &
                          member%watch%stop_is_asked)
      if (allocated(error)) return
      call member%watch%begin(member%machine, member%motion%t_end, motion%observers)
      motion%t_end = member%motion%t_end
      motion%most_events = member%motion%most_events
      select type (by => member%integrator)
      type is (exact_t)
         motion%by => by
      end select
   end subroutine begin

end module razy_study_sweep_crew
