!! What &duel asks for: one entry for each method and setting.
module duel_case
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: lower
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: check_method, method_t
   implicit none(type, external)
   private

   public :: entry_t, read_entries

   !> One method with its setting: a tolerance, or a step in s.
   type :: entry_t
      type(method_t) :: method
      integer :: series = 0
      real(wp) :: setting = 0.0_wp
      logical :: is_step = .false.
   end type entry_t

contains

   !> All entries, in the order of the input. `base` is the method of &motion, whose other settings hold for all.
   subroutine read_entries(entries, base, machine, input, error)
      type(entry_t), allocatable, intent(out) :: entries(:)
      type(method_t), intent(in) :: base
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      allocate (entries(0))
      if (input%count("duel") == 0) then
         call input%complain(error, "duel", 1, "integrator", "required: a method that is set beside others")
         return
      end if
      do i = 1, input%count("duel")
         call add_series(entries, base, machine, input, i, error)
         if (allocated(error)) return
      end do
   end subroutine read_entries

   !> The entries of &duel number i.
   subroutine add_series(entries, base, machine, input, i, error)
      type(entry_t), allocatable, intent(inout) :: entries(:)
      type(method_t), intent(in) :: base
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(entry_t) :: entry
      character(:), allocatable :: allowed, key, text
      real(wp), allocatable :: settings(:), sharpness(:), steps(:)
      integer :: k

      entry%series = i
      entry%method = base
      call input%get("duel", i, "integrator", text)
      entry%method%integrator = lower(text)
      call input%get("duel", i, "tolerance", settings)
      call input%get("duel", i, "step", steps)
      call input%get("duel", i, "sharpness", sharpness)
      if (input%given("duel", i, "band")) call input%get("duel", i, "band", entry%method%band)
      entry%is_step = size(steps) > 0
      if (size(settings) > 0 .and. size(steps) > 0) then
         call input%complain(error, "duel", i, "step", "a list of either tolerances or steps")
         return
      end if
      if (entry%is_step) settings = steps
      ! The exact propagator has nothing to set.
      if (size(settings) == 0) settings = [base%relative_tolerance]
      if (size(sharpness) > 1 .and. size(sharpness) /= size(settings)) then
         call input%complain(error, "duel", i, "sharpness", "one value, or as many as there are tolerances or steps")
         return
      end if
      do k = 1, size(settings)
         call input%get("duel", i, "treatment", text)
         entry%method%treatment = lower(text)
         entry%setting = settings(k)
         if (entry%is_step) then
            entry%method%step = settings(k)
         else
            entry%method%relative_tolerance = settings(k)
            entry%method%absolute_tolerance = settings(k)*(base%absolute_tolerance/base%relative_tolerance)
            entry%method%step = 0.0_wp
         end if
         if (size(sharpness) > 0) entry%method%sharpness = sharpness(min(k, size(sharpness)))
         call check_method(entry%method, machine, key, allowed)
         if (len(key) > 0) then
            call input%complain(error, "duel", i, key, allowed)
            return
         end if
         entries = [entries, entry]
      end do
   end subroutine add_series

end module duel_case
