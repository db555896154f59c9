!! Writes what inputs become: for each file that is named, a line `file quantity value` for each number, but 0, by which its machine
!! can be told from another, before a reduction: of a pair of equal eigenvalues that its end cuts each LAPACK keeps a direction of
!! its own. What ends in skew or acting is relative to the largest that it could be.
program write_machines
   use, intrinsic :: iso_fortran_env, only: output_unit
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: append_text, string_t
   use razy_core_text_file, only: read_text_file
   use razy_input_input, only: input_t
   use razy_machine_machine, only: contact_rows, machine_t
   use razy_scenes_case, only: new_structure, read_study
   implicit none(type, external)

   type(machine_t) :: machine
   type(input_t) :: input
   type(error_t), allocatable :: error
   character(:), allocatable :: text
   character(1000) :: file
   integer :: k

   do k = 1, command_argument_count()
      call get_command_argument(k, file)
      call read_text_file(trim(file), text, error)
      if (allocated(error)) error stop "an input that is not there"
      call read_study(input, text, trim(file), overrides(index(text, "&reduction") == 0), error)
      if (.not. allocated(error)) call new_structure(machine, input, error)
      if (allocated(error)) error stop "an input that is refused"
      call write_machine(machine)
   end do

contains

   function overrides(whole) result(list)
      logical, intent(in) :: whole
      type(string_t), allocatable :: list(:)

      allocate (list(0))
      if (.not. whole) call append_text(list, "reduction%method='none'")
   end function overrides

   subroutine write_machine(machine)
      type(machine_t), intent(in) :: machine

      real(wp), allocatable :: acting(:, :), rows(:, :)
      integer :: j, n

      n = size(machine%load)
      call write_number("coordinates", real(n, wp))
      rows = contact_rows(machine%contact)
      ! What acts on the machine, and where contacts feel it: by these the signs of what couples coordinates are seen.
      acting = reshape([machine%load, real(machine%harmonic_load), aimag(machine%harmonic_load), rows], &
                       [n, 1 + 2*size(machine%tone) + size(rows)/max(n, 1)])
      call write_number("acting", norm2(acting))
      call write_products("acting", acting, acting)
      call write_matrix("mass", machine%mass, acting)
      call write_matrix("damping", machine%damping, acting)
      call write_matrix("stiffness", machine%stiffness, acting)
      call write_number("hertz", sum(machine%tone%hertz))
      call write_number("speed", machine%speed)
      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j))
            call write_number("offset", contact%offset)
            call write_number("error", sum(real(contact%error) + 2*aimag(contact%error)))
            call write_number("drive", contact%drive)
            call write_number("normal", contact%normal)
            call write_number("law", sum(contact%law%branch%stiffness + 2*contact%law%branch%damping + 3*contact%law%branch%offset))
            call write_number("bounds", sum(contact%law%slope) + sum(contact%law%constant) + contact%law%restitution)
         end associate
      end do
   end subroutine write_machine

   !> Norm, trace and skew part of a matrix, and what it makes of the directions of what acts.
   subroutine write_matrix(name, matrix, acting)
      character(*), intent(in) :: name
      real(wp), intent(in) :: matrix(:, :), acting(:, :)

      integer :: i

      call write_number(name//".norm", norm2(matrix))
      call write_number(name//".trace", sum([(matrix(i, i), i=1, size(matrix, 1))]))
      call write_number(name//".skew", norm2(matrix - transpose(matrix))/max(norm2(matrix), tiny(1.0_wp)))
      call write_products(name//".acting", acting, matmul(matrix, acting))
   end subroutine write_matrix

   !> A sum of the products of columns of a with columns of b with weights that no two share, over the largest that it could be.
   subroutine write_products(name, a, b)
      character(*), intent(in) :: name
      real(wp), intent(in) :: a(:, :), b(:, :)

      real(wp) :: total, largest
      integer :: i, j

      total = 0.0_wp
      largest = tiny(1.0_wp)
      do j = 1, size(b, 2)
         do i = 1, size(a, 2)
            if (norm2(a(:, i))*norm2(b(:, j)) > 0.0_wp) then
               total = total + sqrt(i + sqrt(2.0_wp*j))*dot_product(a(:, i), b(:, j))/(norm2(a(:, i))*norm2(a(:, j)))
               largest = largest + norm2(b(:, j))/norm2(a(:, j))
            end if
         end do
      end do
      call write_number(name, total/largest)
   end subroutine write_products

   subroutine write_number(name, value)
      character(*), intent(in) :: name
      real(wp), intent(in) :: value

      if (abs(value) > 0.0_wp) write (output_unit, "(4a, es0.16)") trim(file), " ", name, " ", value
   end subroutine write_number

end program write_machines
