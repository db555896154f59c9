!! The bodies of a lumped scene, what refers to them by name, and their mean speeds.
module razy_scenes_lumped_bodies
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_text, only: did_you_mean, excerpt, lower, position_of, string_t
   use razy_input_input, only: input_t
   use razy_scenes_gears, only: join_speeds
   implicit none(type, external)
   private

   public :: bodies_t, find_body, find_ends, find_row, find_speeds, new_bodies

   !> Bodies, each with one coordinate: first the inertias, then the masses, in the order of the input.
   type :: bodies_t
      integer :: count = 0
      type(string_t), allocatable :: name(:)
      !> kg or kg m².
      real(wp), allocatable :: mass(:)
      logical, allocatable :: turns(:)
   end type bodies_t

contains

   !> All bodies of the input; there has to be one.
   subroutine new_bodies(self, input, error)
      type(bodies_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: group, name
      integer :: i, inertias, n

      inertias = input%count("inertia")
      self%count = inertias + input%count("mass")
      if (self%count == 0) call input%complain(error, "scene", 1, "kind", "a lumped scene needs at least one &inertia or &mass")
      if (allocated(error)) return
      allocate (self%name(self%count), self%mass(self%count), self%turns(self%count))
      do n = 1, self%count
         self%turns(n) = n <= inertias
         group = trim(merge("inertia", "mass   ", self%turns(n)))
         i = merge(n, n - inertias, self%turns(n))
         call input%get(group, i, "name", name)
         call input%get(group, i, "value", self%mass(n))
         self%name(n)%text = name
         if (lower(name) == "frame") call input%complain(error, group, i, "name", "any name but frame, which is what does not move")
         if (allocated(error)) return
      end do
   end subroutine new_bodies

   !> The number of the body that `group(index)%key` names.
   subroutine find_body(self, input, group, index, key, body, error)
      type(bodies_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer, intent(out) :: body
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name

      call input%get(group, index, key, name)
      body = position_of(name, self%name)
      if (body == 0) call input%complain(error, group, index, key, "no body is named "//excerpt(name)//"; " &
                                         //did_you_mean(name, self%name, "bodies"))
   end subroutine find_body

   !> The two bodies that `group(index)%between` names; 0 is the frame. They have to move alike.
   subroutine find_ends(self, input, group, index, ends, error)
      type(bodies_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: index
      integer, intent(out) :: ends(2)
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: names(:)
      integer :: i

      ends = 0
      call input%get(group, index, "between", names)
      do i = 1, 2
         if (lower(names(i)%text) == "frame") cycle
         ends(i) = position_of(names(i)%text, self%name)
         if (ends(i) == 0) then
            call input%complain(error, group, index, "between", "no body is named "//excerpt(names(i)%text)//"; " &
                                //did_you_mean(names(i)%text, [self%name, string_t("frame")], "bodies"))
            return
         end if
      end do
      if (ends(1) == ends(2)) then
         call input%complain(error, group, index, "between", "two different bodies, or a body and 'frame'")
      else if (all(ends > 0)) then
         if (self%turns(ends(1)) .neqv. self%turns(ends(2))) then
            call input%complain(error, group, index, "between", "two inertias or two masses, not one of each")
         end if
      end if
   end subroutine find_ends

   !> The row w with which q1 - q2 = wᵀq of the bodies that `group(index)%between` names follows from the coordinates, and
   !> whether it is an angle.
   subroutine find_row(self, input, group, index, w, turns, error)
      type(bodies_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: index
      real(wp), allocatable, intent(out) :: w(:)
      logical, intent(out) :: turns
      type(error_t), allocatable, intent(out) :: error

      integer :: ends(2)

      call find_ends(self, input, group, index, ends, error)
      if (allocated(error)) return
      allocate (w(self%count), source=0.0_wp)
      if (ends(1) > 0) w(ends(1)) = 1.0_wp
      if (ends(2) > 0) w(ends(2)) = -1.0_wp
      turns = self%turns(maxval(ends))
   end subroutine find_row

   !> Mean speeds of all bodies over that of `&rotation`, from which tooth frequencies follow; 0 where nothing says what it
   !> is. Bodies joined by springs, dampers or stops have the same mean speed; a mesh changes it in the ratio of the teeth.
   subroutine find_speeds(self, input, ratio, error)
      type(bodies_t), intent(in) :: self
      type(input_t), intent(in) :: input
      real(qp), allocatable, intent(out) :: ratio(:)
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: joining(4) = [character(9) :: "spring", "damper", "stop", "gear_mesh"]
      real(qp), parameter :: rounding = 1.0e-20_qp
      character(:), allocatable :: group
      integer, allocatable :: teeth(:)
      real(qp) :: change
      integer :: body, ends(2), i, k, known
      logical :: agree

      allocate (ratio(self%count), source=0.0_qp)
      if (input%count("rotation") == 0) return
      call find_body(self, input, "rotation", 1, "of", body, error)
      if (allocated(error)) return
      if (.not. self%turns(body)) call input%complain(error, "rotation", 1, "of", "the name of an inertia")
      if (allocated(error)) return
      ratio(body) = 1.0_qp
      do
         known = count(abs(ratio) > 0.0_qp)
         do k = 1, size(joining)
            group = trim(joining(k))
            do i = 1, input%count(group)
               change = 1.0_qp
               if (group == "gear_mesh") then
                  call input%get(group, i, "teeth", teeth)
                  change = real(teeth(1), qp)/teeth(2)
               end if
               call find_ends(self, input, group, i, ends, error)
               if (allocated(error)) return
               if (any(ends == 0)) cycle
               call join_speeds(ratio(ends(1)), ratio(ends(2)), change, rounding, agree)
               if (agree) cycle
               call input%complain(error, group, i, "between", "bodies whose mean speeds agree with the rest of the machine")
               return
            end do
         end do
         if (count(abs(ratio) > 0.0_qp) == known) return
      end do
   end subroutine find_speeds

end module razy_scenes_lumped_bodies
