!! Where a motion starts.
module razy_scenes_start
   use razy_contact_contact_law, only: branch_open
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: lower
   use razy_machine_equilibrium, only: find_equilibrium
   use razy_machine_machine, only: machine_t
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: check_start, set_start

contains

   !> The machine without its circulatory forces, the skew part of K, which have no potential. Where K is symmetric, itself.
   pure function at_rest(machine) result(copy)
      type(machine_t), intent(in) :: machine
      type(machine_t) :: copy

      copy = machine
      associate (skew => machine%stiffness - transpose(machine%stiffness))
         if (any(abs(skew) > 1.0e-12_wp*maxval(abs(machine%stiffness)))) copy%stiffness = machine%stiffness - 0.5_wp*skew
      end associate
   end function at_rest

   !> Displacement and velocity at the time 0.
   subroutine set_start(machine, scene, input, error)
      type(machine_t), intent(inout) :: machine
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: start
      logical :: found
      integer :: j, n

      n = size(machine%load)
      allocate (machine%displacement(n), machine%velocity(n), source=0.0_wp)
      call input%get("motion", 1, "start", start)
      if (input%count("initial") > 0 .and. lower(start) /= "given") then
         call input%complain(error, "motion", 1, "start", "'given' where the file has &initial")
         return
      end if
      select case (lower(start))
      case ("static")
         do j = 1, size(machine%contact)
            if (.not. any(machine%contact(j)%law%constraint)) cycle
            call input%complain(error, "motion", 1, "start", "'zero', or 'given' with &initial: '"//machine%contact(j)%name// &
                                "' is a rigid stop or dry friction, with which an equilibrium is not one position")
            return
         end do
         call find_equilibrium(at_rest(machine), machine%displacement, found)
         if (.not. found) call input%complain(error, "motion", 1, "start", "the constant loads are in no equilibrium: balance "// &
                                              "them, or start from 'zero' or 'given'")
      case ("zero")
      case default
         call scene%set_initial(machine, input, error)
      end select
      if (.not. allocated(error)) call check_start(machine, input, error)
   end subroutine set_start

   !> A motion cannot start beyond a rigid stop.
   subroutine check_start(machine, input, error)
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: rounding, s
      integer :: j

      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j), edge => machine%contact(j)%law%guard(1, branch_open))
            if (.not. contact%law%impacts) cycle
            s = dot_product(contact%w, machine%displacement) + contact%offset + sum(real(contact%error))
            rounding = 16*epsilon(1.0_wp)*(dot_product(abs(contact%w), abs(machine%displacement)) + abs(contact%offset) &
                                           + sum(abs(contact%error)))
            if (.not. ((edge%above /= 0 .and. s > edge%upper + rounding) &
                       .or. (edge%below /= 0 .and. s < edge%lower - rounding))) cycle
            call input%complain(error, "motion", 1, "start", "a state that is not beyond the rigid stop '"//contact%name// &
                                "'; give the position by start = 'given' and &initial")
            return
         end associate
      end do
   end subroutine check_start

end module razy_scenes_start
